use super::*;

const COUNT: usize = 37;

/// What component `k` of point `i` is.
fn value(i: usize, k: usize) -> f32 {
    (3 * i + k) as f32
}

/// Bytes, the offsets of the components of the first point, and the stride: of every kind of layout.
fn layouts() -> Vec<(Vec<u8>, [usize; 3], isize)> {
    let plane = 4 * COUNT;
    let room = |bytes| vec![0; bytes];
    vec![
        (room(3 * plane), [0, 4, 8], 12),
        (room(4 * plane), [0, 4, 8], 16),
        (room(8 * plane), [0, 4, 8], 32),
        (room(5 * plane), [1, 5, 9], 20),
        (room(3 * plane), [8, 4, 0], 12),
        (room(3 * plane), [0, plane, 2 * plane], 4),
        (room(21 * COUNT), [1, 7, 13], 21),
        (room(3 * plane), [3 * plane - 12, 3 * plane - 8, 3 * plane - 4], -12),
    ]
}

/// Where component `k` of point `i` lies.
fn place(i: usize, k: usize, starts: &[usize; 3], stride: isize) -> usize {
    starts[k].wrapping_add_signed(offset(stride, i))
}

#[test]
fn every_layout_is_gathered_and_scattered_alike() {
    let mask: Vec<bool> = (0..COUNT).map(|i| i % 3 != 1).collect();
    for (mut bytes, starts, stride) in layouts() {
        for (i, k) in (0..3 * COUNT).map(|n| (n / 3, n % 3)) {
            let at = place(i, k, &starts, stride);
            bytes[at..at + 4].copy_from_slice(&value(i, k).to_ne_bytes());
        }
        for (active, first) in [(None, 0), (Some(&*mask), 0), (None, 5)] {
            let chosen = Chosen { first, count: COUNT - first, active };
            let is_active = |i: usize| active.is_none_or(|active| active[i]);
            let component = starts.map(|start| bytes.as_ptr().wrapping_add(start).cast());
            let mut room = room();
            // SAFETY: all points are within the bytes.
            let found = unsafe { Vectors { component, stride }.gather(&chosen, &mut room) };
            for (i, k) in (0..3 * chosen.count).map(|n| (n / 3, n % 3)) {
                let expected = if is_active(i) { value(first + i, k) } else { 0.0 };
                assert_eq!(found[k][i], expected, "{starts:?} {stride} {first}: {i}, {k}");
            }

            let mut planes = [[0.0; BLOCK]; 3];
            for (plane, found) in planes.iter_mut().zip(found) {
                plane[..chosen.count].copy_from_slice(found);
            }
            let mut copy = vec![0xff; bytes.len()];
            let start = copy.as_mut_ptr();
            let component = starts.map(|at| start.wrapping_add(at).cast());
            // SAFETY: all points are within the bytes.
            unsafe {
                VectorsOut { component, stride }
                    .scatter(&chosen, planes.each_ref().map(|plane| &plane[..]));
            };
            let mut expected = vec![0xff; bytes.len()];
            for (i, k) in (0..3 * chosen.count).map(|n| (n / 3, n % 3)) {
                let at = place(first + i, k, &starts, stride);
                if is_active(i) {
                    expected[at..at + 4].copy_from_slice(&bytes[at..at + 4]);
                }
            }
            assert!(copy == expected, "{starts:?} {stride} {first}: another byte is written");
        }
    }
}

#[test]
fn one_value_stands_for_all() {
    let (one, mut room) = ([7.0, 8.0], room());
    let positions = Positions { component: [&raw const one[0], &raw const one[1]], stride: 0 };
    let chosen = Chosen { first: 4, count: COUNT, active: None };
    // SAFETY: with a stride of 0 all points are the first.
    let found = unsafe { positions.gather(&chosen, &mut room) };
    assert!(found[0].iter().all(|&u| u == 7.0) && found[1].iter().all(|&v| v == 8.0));
}
