//! The corners of a face line, read without the parser: quick, and only for lines that are written plainly.

use super::survey::Present;

/// The vertex, texture coordinate and normal that a corner names, counted from one; zero for none.
pub(super) type Corner = [u32; 3];

/// Which attributes a corner names, however it is written.
pub(super) fn present(corner: &str) -> Present {
    let mut parts = corner.split('/').skip(1);
    let mut names = || parts.next().is_some_and(|part| !part.is_empty());
    Present {
        uv: names(),
        normal: names(),
    }
}

/// Calls `visit` on each corner of what follows `f`. False when something is written otherwise than as
/// `v`, `v/vt`, `v//vn` or `v/vt/vn` with positive numbers of less than ten digits: then not all were visited.
pub(super) fn visit(line: &[u8], mut visit: impl FnMut(Corner)) -> bool {
    let mut at = 0;
    loop {
        while matches!(line.get(at), Some(b' ' | b'\t' | b'\r')) {
            at += 1;
        }
        if at == line.len() {
            return true;
        }
        let mut corner: Corner = [0; 3];
        for (kind, slot) in corner.iter_mut().enumerate() {
            let begin = at;
            while let Some(digit) = line.get(at).filter(|byte| byte.is_ascii_digit()) {
                *slot = slot.wrapping_mul(10).wrapping_add(u32::from(digit - b'0'));
                at += 1;
            }
            let is_named = at > begin;
            let may_be_left_out = kind == 1 && line.get(at) == Some(&b'/');
            if at - begin > 9 || (*slot == 0 && is_named) || !(is_named || may_be_left_out) {
                return false;
            }
            if kind == 2 || line.get(at) != Some(&b'/') {
                break;
            }
            at += 1;
        }
        if !matches!(line.get(at), None | Some(b' ' | b'\t' | b'\r')) {
            return false;
        }
        visit(corner);
    }
}

/// Writes a corner whose numbers count from `base` on, with a blank before it.
pub(super) fn write(text: &mut Vec<u8>, corner: Corner, base: Corner) {
    let [v, vt, vn] = [0, 1, 2].map(|kind| corner[kind].saturating_sub(base[kind]));
    text.push(b' ');
    write_number(text, v);
    if vt > 0 || vn > 0 {
        text.push(b'/');
    }
    if vt > 0 {
        write_number(text, vt);
    }
    if vn > 0 {
        text.push(b'/');
        write_number(text, vn);
    }
}

fn write_number(text: &mut Vec<u8>, mut number: u32) {
    let mut digits = [0; 10];
    let mut first = digits.len();
    while first == digits.len() || number > 0 {
        first -= 1;
        digits[first] = b'0' + (number % 10) as u8;
        number /= 10;
    }
    text.extend_from_slice(&digits[first..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners(line: &str) -> Option<Vec<Corner>> {
        let mut corners = Vec::new();
        visit(line.as_bytes(), |corner| corners.push(corner)).then_some(corners)
    }

    #[test]
    fn plain_corners_are_read_and_others_refused() {
        let read = corners(" 1 2/3  4//5\t67/89/10 \r");
        let expected = [[1, 0, 0], [2, 3, 0], [4, 0, 5], [67, 89, 10]];
        assert_eq!(read.as_deref(), Some(&expected[..]));
        assert_eq!(corners("").as_deref(), Some(&[][..]));
        let others = [
            "0",
            "-1",
            "+1",
            "1/",
            "1//",
            "/1",
            "1/2/",
            "1/2/3/4",
            "1.5",
            "1/0",
            "1234567890",
        ];
        for other in others {
            assert_eq!(corners(other), None, "{other}");
        }
    }

    #[test]
    fn corners_are_written_as_they_are_read() {
        for corner in [
            [11, 0, 0],
            [12, 23, 0],
            [13, 0, 34],
            [110, 220, 999_999_999],
        ] {
            let mut text = Vec::new();
            write(&mut text, corner, [10, 20, 30]);
            let moved = [0, 1, 2].map(|kind| corner[kind].saturating_sub([10, 20, 30][kind]));
            let text = String::from_utf8(text).expect("digits");
            assert_eq!(corners(&text).as_deref(), Some(&[moved][..]));
        }
    }
}
