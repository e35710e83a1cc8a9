//! Error measures against implementations that are not ours: the FLIP of its authors, scikit-image and NumPy, on made-up
//! pairs of pictures. `oracle.py` makes the same pictures and wrote what they give.

use lucerna::core::stats::flip;
use lucerna::core::stats::metrics::errors;

/// A hash of 32 bits (Wang 2007).
fn scrambled(n: u64) -> f64 {
    let n = n as u32;
    let n = (n ^ 61 ^ (n >> 16)).wrapping_mul(9);
    let n = (n ^ (n >> 4)).wrapping_mul(0x27d4_eb2d);
    f64::from(n ^ (n >> 15)) / 2_f64.powi(32)
}

/// Reference and picture number `k`.
fn pair(k: u64, [width, height]: [usize; 2]) -> [Vec<f32>; 2] {
    let value = |x: usize, y: usize, c: usize| {
        let [px, py] = [x, y].map(|v| v as u64);
        let chance = scrambled(((k * 3 + c as u64) * 512 + py) * 512 + px);
        let rare = scrambled((k * 512 + py) * 512 + px + 77_777_777);
        let step = (px / (3 + k % 5) + py / 6) % 2;
        let level = 0.1 + 0.5 * ((c as u64 + k) % 3) as f64 + 0.8 * step as f64 * (x as f64 / width as f64);
        let reference = level * (1.0 + (k % 4) as f64 * 20.0 * (y as f64 / height as f64).powi(4));
        let noise = (0.05 + 0.1 * (k % 6) as f64) * (chance - 0.5);
        let image = reference * (1.0 + 0.03 * ((k % 3) as f64 - 1.0) + noise);
        [reference as f32, if rare < 0.003 { image * 40.0 } else { image } as f32]
    };
    let moved = if k % 5 == 4 { 2 } else { 0 };
    let picture = |which: usize, moved: usize| {
        let places = (0..height).flat_map(|y| (0..width).map(move |x| ((x + width - moved) % width, y)));
        places.flat_map(|(x, y)| [0, 1, 2].map(|c| value(x, y, c)[which])).collect()
    };
    [picture(0, 0), picture(1, moved)]
}

#[test]
fn measures_are_those_of_others() {
    let rows = include_str!("expected.csv").lines().skip(1);
    let mut compared = 0;
    for row in rows {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let (k, size) = (cells[0] as u64, [cells[1] as usize, cells[2] as usize]);
        let [reference, image] = pair(k, size);
        let found = errors(&image, &reference, 3).expect("errors");
        for (ours, theirs) in [found.mse, found.rel_mse, found.mape, found.smape].iter().zip(&cells[3..7]) {
            assert!((ours / theirs - 1.0).abs() < 1e-5, "pair {k}: {ours} instead of {theirs}");
        }
        let [width, height] = size;
        let places = [height / 2 * width + width / 2, 0, (height - 1) * width + width / 3];
        let maps = [flip::ldr(&image, &reference, 3, width, 1.0), flip::hdr(&image, &reference, 3, width)];
        for (name, map, theirs) in [("LDR", &maps[0], &cells[7..11]), ("HDR", &maps[1], &cells[11..15])] {
            let map = map.as_ref().expect("a map");
            let ours = [flip::mean(map), map[places[0]].into(), map[places[1]].into(), map[places[2]].into()];
            println!("pair {k} {name}: {ours:.5?} {theirs:.5?}");
            for (ours, theirs) in ours.iter().zip(theirs) {
                assert!((ours - theirs).abs() < 2e-4, "pair {k}, {name}: {ours} instead of {theirs}");
            }
        }
        compared += 1;
    }
    assert_eq!(compared, 20);
}
