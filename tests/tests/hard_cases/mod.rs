//! Numerically hard cases: what must hold where geometry, numbers or light are at their worst.
//!
//! Properties that other modules show as part of their subject are named here and not shown again.
//!
//! | # | case | shown by |
//! |---|---|---|
//! | 1 | patches that share an edge | `form_factors::a_shared_edge_has_no_singularity`, `crate::form_factors` |
//! | 2 | nearly folded, nearly flat | `form_factors::nearly_folded_and_nearly_flat_pairs_stay_in_range` |
//! | 3 | near-touching plates | `form_factors::what_escapes_between_near_plates_is_right` |
//! | 4 | reflectance 0.999, 0.9999 | `solving::a_white_furnace_is_as_right_as_its_closure` |
//! | 5 | Jacobi against Gauss–Seidel | `crate::enclosures::{sweeps_in_a_closed_cube_are_those_of_theory, gauss_seidel_converges_at_the_rate_of_the_cube, what_does_not_contract_is_refused}`, `crate::solvers`; growth from B = S: `luxel_solver::solvers::jacobi` |
//! | 6 | T-junctions | `geometry::a_t_junction_neither_leaks_nor_shows` |
//! | 7 | coplanar duplicate faces | `geometry::a_face_that_is_there_twice_counts_once` |
//! | 8 | faces without area | `geometry::faces_without_area_change_nothing` |
//! | 9 | inverted normals | `geometry::a_plate_that_faces_away_exchanges_nothing` |
//! | 10 | NaN, infinite and impossible values | `crate::bad_input::broken_geometry_and_materials_are_refused_by_every_verb`, `crate::bad_input::broken_scene_files_are_refused_by_every_verb` |
//! | 11 | scale 1e-6 and 1e6 | `geometry::neither_units_nor_origin_change_the_light` |
//! | 12 | offset 1e6 | `geometry::neither_units_nor_origin_change_the_light` |
//! | 13 | emitters 1e8 brighter than the rest | `solving::a_bright_lamp_does_not_drown_a_dim_one`, `crate::enclosures::solutions_are_linear_in_the_light_over_eight_decades` |
//! | 14 | light through a pin-hole | `form_factors::a_pin_hole_passes_what_it_should` |
//! | 15 | dark room beside a lit one | `rooms::{walls_that_cross_and_gaps_keep_a_room_dark, a_floor_shared_by_two_rooms_keeps_one_dark, patches_of_a_floor_shared_by_two_rooms_keep_one_dark}`, `crate::stress_rays::a_dark_room_beside_a_lit_one_stays_dark` |
//! | 16 | thin walls | `rooms::the_sides_of_a_thin_wall_are_independent`, shared floors: those of row 15 |
//! | 17 | slivers | `form_factors::slivers_keep_their_accuracy_and_reciprocity`, `crate::form_factors` |
//! | 18 | tiny far source | `form_factors::far_squares_keep_their_digits`, `crate::form_factors` |
//! | 19 | polygon that crosses the horizon | `form_factors::a_polygon_sinks_through_the_horizon_without_a_step` |
//! | 20 | partial occlusion by few samples | `form_factors::few_points_find_the_visible_share` |
//! | 21 | unity furnace | `solving::an_l_shaped_furnace_is_even`, `crate::enclosures::a_furnace_has_one_radiosity_everywhere`, `crate::enclosures::a_furnace_with_a_box_in_it_has_one_radiosity_everywhere` |
//! | 22 | open scene | `solving::an_open_box_is_not_closed_by_force` |
//! | 23 | ρ = 0 in one channel | `solving::a_black_channel_keeps_its_emission_to_the_bit`; every solver: `luxel_solver::solvers::conformance` |
//! | 24 | long corridor, dark end | `solving::the_dark_end_of_a_corridor_is_relatively_right` |
//! | 25 | L-corner at the shared edge | `crate::enclosures::the_dark_side_of_a_corner_tends_to_its_limit_at_the_edge` |

mod form_factors;
mod geometry;
mod rooms;
mod solving;
