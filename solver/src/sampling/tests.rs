//! Round trips of the warps: square → sample → square, also at the borders of the square.

use super::*;
use glam::{DVec3, Vec3};

/// Points of the unit square: a scrambled sequence, and a lattice that reaches the borders.
fn square() -> impl Iterator<Item = [f64; 2]> {
    let sequence = Sequence::new(5, Stage(1000), 0);
    let lattice = (0..=16).flat_map(|i| (0..=16).map(move |j| [i, j].map(|k| f64::from(k) / 16.0)));
    (0..4096).map(move |i| sequence.point2(i)).chain(lattice)
}

/// Points of the unit square that are not closer than 2⁻¹² to its border.
fn inner_square() -> impl Iterator<Item = [f64; 2]> {
    square().map(|u| u.map(|x| x.clamp(1.0 / 4096.0, 1.0 - 1.0 / 4096.0)))
}

#[track_caller]
fn assert_close(a: [f64; 2], b: [f64; 2], tolerance: f64) {
    let error = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    assert!(error <= tolerance, "{a:?} and {b:?} differ by {error}");
}

fn narrow(u: [f64; 2]) -> [f32; 2] {
    u.map(|x| x as f32)
}

fn widen(u: [f32; 2]) -> [f64; 2] {
    u.map(f64::from)
}

#[test]
fn disk_and_cosine_hemisphere_invert() {
    // Roundings of f32 coordinates near 1, and of the arc tangent: a few 1e-7.
    for u in square().map(narrow) {
        assert_close(widen(disk::invert(disk::sample(u))), widen(u), 5e-7);
        let w = cosine_hemisphere::sample(u);
        assert_close(widen(cosine_hemisphere::invert(w)), widen(u), 5e-7);
        let w = mixed_hemisphere::sample(u);
        assert!((w.length() - 1.0).abs() < 3e-7 && w.z >= 0.0, "{w}");
        assert_close(widen(mixed_hemisphere::invert(w)), widen(u), 5e-7);
    }
}

#[test]
fn hemisphere_and_sphere_invert() {
    for u in inner_square().map(narrow) {
        let up = sphere::sample_hemisphere(u);
        assert!((up.length() - 1.0).abs() < 3e-7, "{up}");
        assert_close(widen(sphere::invert_hemisphere(up)), widen(u), 5e-7);
        let w = sphere::sample_sphere(u);
        assert!((w.length() - 1.0).abs() < 3e-7, "{w}");
        assert_close(widen(sphere::invert_sphere(w)), widen(u), 5e-7);
    }
    assert_eq!(sphere::sample_sphere([0.25, 0.5]), Vec3::Z);
    assert_eq!(sphere::sample_sphere([0.75, 0.5]), -Vec3::Z);
}

#[test]
fn triangle_inverts() {
    for u in square() {
        let b = triangle::sample(u);
        assert!(b.iter().all(|&x| x >= 0.0), "{b:?}");
        assert!((b.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{b:?}");
        assert_close(triangle::invert(b), u, 1e-15);
    }
}

#[test]
fn bilinear_inverts() {
    for corners in [
        [1.0, 1.0, 1.0, 1.0],
        [0.01, 0.2, 1.0, 3.0],
        [0.0, 1.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ] {
        for u in inner_square() {
            // 1e-12: where the density vanishes a rounding of the sample is divided by it.
            assert_close(
                bilinear::invert(bilinear::sample(u, corners), corners),
                u,
                1e-12,
            );
        }
    }
}

/// Convex polygons: a square, a trapezium, a quadrilateral with a straight corner, a triangle, a
/// hexagon; the last two neither near the origin nor in a coordinate plane.
fn polygons() -> Vec<Vec<DVec3>> {
    let flat = |points: &[[f64; 2]]| {
        points
            .iter()
            .map(|&[x, y]| DVec3::new(x, y, 0.0))
            .collect::<Vec<_>>()
    };
    let tilted = |points: &[[f64; 2]]| {
        points
            .iter()
            .map(|&[x, y]| {
                DVec3::new(3.0, -2.0, 5.0) + DVec3::new(0.6, 0.0, 0.8) * x + DVec3::Y * y
            })
            .collect::<Vec<_>>()
    };
    vec![
        flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        flat(&[[0.0, 0.0], [4.0, 0.0], [3.0, 1.0], [2.5, 1.0]]),
        flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 2.0]]),
        tilted(&[[0.0, 0.0], [2.0, 0.0], [0.3, 1.0]]),
        tilted(&[
            [1.0, 0.0],
            [2.0, 0.2],
            [2.5, 1.0],
            [1.5, 1.9],
            [0.5, 1.5],
            [0.2, 0.8],
        ]),
    ]
}

#[test]
fn polygon_inverts() {
    for vertices in polygons() {
        let polygon = Polygon::new(&vertices).expect("a convex polygon");
        assert!((polygon.pdf() * polygon.area() - 1.0).abs() < 1e-15);
        for u in inner_square() {
            let point = polygon.sample(u);
            let inside = vertices
                .iter()
                .zip(vertices.iter().cycle().skip(1))
                .all(|(&a, &b)| (b - a).cross(point - a).dot(polygon.normal()) >= -1e-14);
            assert!(inside, "{point} is outside {vertices:?}");
            // Compared as points: at the seams of a fan u jumps. Straight corners cost 1e-16·4096.
            let back = polygon.sample(polygon.invert(point));
            assert!(
                (back - point).length() < 1e-11,
                "{u:?}: {point} came back as {back}"
            );
        }
    }
}

#[test]
fn polygons_without_area_are_refused() {
    assert_eq!(Polygon::new(&[]), None);
    assert_eq!(Polygon::new(&[DVec3::X, DVec3::Y]), None);
    assert_eq!(Polygon::new(&[DVec3::X, DVec3::Y, DVec3::X]), None);
    assert_eq!(
        Polygon::new(&[DVec3::X, DVec3::Y, DVec3::splat(f64::NAN)]),
        None
    );
}

/// Triangles from nearly a hemisphere to 1e-17 sr, slivers and edge-on ones, each with the smallest
/// angle in radians that a sampler has to resolve in it.
fn triangles() -> Vec<([DVec3; 3], f64)> {
    let v = DVec3::new;
    let mut triangles = vec![
        ([DVec3::X, DVec3::Y, DVec3::Z], 1.0),
        ([DVec3::X, DVec3::Z, DVec3::Y], 1.0),
        // Below the point, which sees nearly a hemisphere.
        (
            [v(-1.0, -1.0, 1e-3), v(3.0, -1.0, 1e-3), v(-1.0, 3.0, 1e-3)],
            1e-3,
        ),
        (
            [v(-1.0, -1.0, 1e-6), v(3.0, -1.0, 1e-6), v(-1.0, 3.0, 1e-6)],
            1e-6,
        ),
        // Edge-on.
        (
            [v(1.0, 0.0, 1e-4), v(100.0, 1.0, 1e-4), v(100.0, -1.0, 1e-4)],
            1e-4,
        ),
        // Slivers.
        (
            [v(1.0, 0.0, 1.0), v(-1.0, 1e-6, 1.0), v(0.0, 1e-6, 1.0)],
            1e-6,
        ),
        (
            [v(1.0, 1.0, 1.0), v(1.0, 1.0, 1.0 + 1e-8), v(0.0, -1.0, 1.0)],
            1e-8,
        ),
    ];
    for exponent in [1, 2, 3, 4, 5, 6, 8] {
        let size = 10_f64.powi(-exponent);
        let corner = v(0.3, -0.4, 0.87);
        let other = corner + v(size, 0.1 * size, 0.0);
        triangles.push((
            [corner, other, corner + v(0.2 * size, size, 0.3 * size)],
            size,
        ));
    }
    triangles
}

#[test]
fn spherical_triangle_inverts() {
    let origin = DVec3::new(0.5, 0.25, -0.125);
    for (vertices, scale) in triangles() {
        let seen = vertices.map(|p| p + origin);
        let triangle = SphericalTriangle::new(origin, seen).expect("a visible triangle");
        let projected =
            ProjectedSphericalTriangle::new(origin, DVec3::Z, seen).expect("a visible triangle");
        let size = vertices
            .iter()
            .map(|p| p.normalize().distance(vertices[0].normalize()))
            .fold(0.0, f64::max);
        // Some tens of roundings of directions by 1e-16, seen at the scale of the triangle.
        let tolerance = 1e-14 / scale;
        for u in inner_square() {
            let s = triangle.sample(u);
            let p = projected.sample(u);
            for (s, back, pdf) in [
                (
                    s,
                    triangle.sample(triangle.invert(s.direction)),
                    triangle.pdf(s.direction),
                ),
                (
                    p,
                    projected.sample(projected.invert(p.direction)),
                    projected.pdf(p.direction),
                ),
            ] {
                assert!((s.direction.length() - 1.0).abs() < 1e-15, "{vertices:?}");
                assert!(s.pdf > 0.0 && s.pdf.is_finite(), "{vertices:?}: {s:?}");
                let error = s.direction.distance(back.direction) / size;
                assert!(error < tolerance, "{vertices:?}: {error}");
                let error = (s.pdf / pdf - 1.0).abs();
                assert!(error < 10.0 * tolerance, "{vertices:?}: density {error}");
                let [a, b, c] = s.barycentric;
                assert!(a >= 0.0 && b >= 0.0 && c >= 0.0 && (a + b + c - 1.0).abs() < 1e-15);
                let met = vertices[0] * a + vertices[1] * b + vertices[2] * c;
                let error = met.normalize().distance(s.direction) / size;
                assert!(error < tolerance, "{vertices:?}: barycentric {error}");
            }
        }
    }
}

#[test]
fn solid_angles_are_exact() {
    let solid_angle = |v| {
        SphericalTriangle::new(DVec3::ZERO, v)
            .expect("visible")
            .solid_angle()
    };
    let octant = solid_angle([DVec3::X, DVec3::Y, DVec3::Z]);
    assert!(
        (octant - std::f64::consts::FRAC_PI_2).abs() < 1e-15,
        "{octant}"
    );
    // Small: area over squared distance, exact to the square of the size.
    let v = DVec3::new;
    let small = solid_angle([v(0.0, 0.0, 2.0), v(1e-8, 0.0, 2.0), v(0.0, 1e-8, 2.0)]);
    assert!((small / 1.25e-17 - 1.0).abs() < 1e-14, "{small}");
    // The faces of a tetrahedron around the point make up the sphere.
    let corners = [
        v(1.0, 0.2, -0.1),
        v(-0.7, 0.9, 0.1),
        v(-0.5, -0.8, 0.3),
        v(0.1, 0.0, -1.1),
    ];
    let sum: f64 = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
        .map(|face| solid_angle(face.map(|i| corners[i])))
        .iter()
        .sum();
    assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-14, "{sum}");
}

#[test]
fn invisible_triangles_are_none() {
    let v = DVec3::new;
    for vertices in [
        // Degenerate; through the point's own plane; with a corner at the point; not a number.
        [DVec3::X, DVec3::X, DVec3::Y],
        [v(1.0, 0.0, 0.0), v(2.0, 0.0, 0.0), v(1.0, 1.0, 0.0)],
        [DVec3::ZERO, DVec3::X, DVec3::Y],
        [DVec3::NAN, DVec3::X, DVec3::Y],
    ] {
        assert_eq!(SphericalTriangle::new(DVec3::ZERO, vertices), None);
        assert_eq!(
            ProjectedSphericalTriangle::new(DVec3::ZERO, DVec3::Z, vertices),
            None
        );
    }
}
