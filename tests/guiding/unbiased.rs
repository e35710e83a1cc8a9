//! Guided pictures agree with those of `path`, however good or bad the guide is.

use super::{PANE, SCENES, corrupted, guided, left_to_the_bsdf, scene};
use crate::support::{render, render_with};
use lucerna::core::image::Image;
use lucerna::core::render::{GuideFile, SampleOrder};
use lucerna::core::scene::Scene;
use lucerna::core::stats::Measured;
use lucerna::core::stats::chi2::sidak;
use lucerna::core::stats::figures::measured;
use lucerna::core::stats::images::{Scale, compare};
use std::path::Path;

/// Independent pictures of each method.
const SEEDS: u32 = 10;

fn pictures(text: &str, integrator: &str, spp: u32, first_seed: u32) -> Measured {
    pictures_of(&scene(text, integrator), spp, first_seed)
}

/// Independent pictures of a scene.
pub fn pictures_of(scene: &Scene, spp: u32, first_seed: u32) -> Measured {
    let shots: Vec<Image> =
        (0..SEEDS).map(|seed| render(scene, spp, first_seed + seed, SampleOrder::PerSample).0).collect();
    Measured::of(&shots, &["R", "G", "B"].map(str::to_owned)).expect("ten pictures of a size")
}

pub fn path(depth: u32, guide: &str) -> String {
    format!("<integrator type='path'><integer name='max_depth' value='{depth}'/>{guide}</integrator>")
}

/// Compares guides with `path` in these scenes; the level of 1 % is shared among all of them. Gives the error of the mean
/// that would be found.
pub fn agree(scenes: &[(&str, &str)], guides: &[String], depth: u32, spp: u32) -> f64 {
    let level = sidak(0.01, guides.len() * scenes.len());
    let mut blind: f64 = 0.0;
    for &(name, text) in scenes {
        let plain = pictures(text, &path(depth, ""), 2 * spp, 1000);
        for (i, guide) in guides.iter().enumerate() {
            let guided = pictures(text, &path(depth, guide), spp, 100 * (i as u32 + 20));
            let found = compare(&guided, &plain, true, level).expect("of a kind");
            let (difference, error) = found.mean_difference();
            let worst = |scale| found.test(scale).worst().0;
            assert!(
                found.agrees(),
                "{name}, {guide}: mean differs by {:.2} % ± {:.2} %; tiles {:?}; pixels {:?}",
                100.0 * difference,
                100.0 * error,
                worst(Scale::Tile),
                worst(Scale::Pixel)
            );
            blind = blind.max(found.detectable());
        }
    }
    blind
}

#[test]
fn hc_p06_every_setting_of_the_tree_is_unbiased() {
    let guide = |more: &str| guided(200, more);
    let guides = [
        guide(""),
        guide("<string name='nee' value='never'/>"),
        guide("<string name='nee' value='kickstart'/><boolean name='direct' value='false'/>"),
        guide("<string name='product' value='none'/><string name='spatial_filter' value='box'/>"),
        guide("<float name='roughness_threshold' value='0'/><string name='combination' value='last'/>"),
        guide("<float name='p_guide' value='0'/>"),
        left_to_the_bsdf(200),
        guide("<float name='prior' value='0'/><float name='memory' value='0'/>"),
        guide("<string name='product' value='resampling'/>"),
        guide("<string name='sets' value='direct_indirect'/>"),
        guide("<string name='sets' value='direct_indirect'/><string name='nee' value='never'/>"),
        guide("<string name='sets' value='direct_indirect'/><string name='product' value='resampling'/>"),
        guide("<string name='sets' value='primary_product'/>"),
        guide("<string name='sets' value='primary_product'/><float name='roughness_threshold' value='0'/>"),
        guide("<string name='sets' value='primary_product'/><string name='product' value='resampling'/>"),
        guide(
            "<string name='product' value='resampling'/><integer name='candidates' value='16'/><string name='nee' value='never'/>",
        ),
    ];
    let blind = agree(&SCENES, &guides, 9, 64);
    measured(
        "hc_p06_every_setting_of_the_tree_is_unbiased",
        format!(
            "{} settings in {} scenes agree; an error of {:.1} % of the mean would be found",
            guides.len(),
            SCENES.len(),
            100.0 * blind
        ),
    );
}

#[test]
fn hc_p06_corrupted_guides_are_unbiased() {
    let mut guides = Vec::new();
    for way in corrupted::WAYS {
        guides.push(format!("<guide type='corrupted'><string name='way' value='{way}'/></guide>"));
    }
    for sets in ["direct_indirect", "primary_product"] {
        guides.push(format!(
            "<guide type='corrupted'><string name='way' value='random'/><string name='sets' value='{sets}'/></guide>"
        ));
    }
    for way in ["random", "inverted", "one_direction"] {
        guides.push(format!(
            "<guide type='corrupted'><string name='way' value='{way}'/><integer name='candidates' value='5'/></guide>"
        ));
    }
    let blind = agree(&SCENES, &guides, 9, 32);
    // Given probabilities are not mended by learning, as those above are. Where the guide has no density, what the BSDF finds
    // is found with probability 1 − p and counts 1/(1 − p): after k vertices its second moment is (1 − p)^-k. With 0.7 that is
    // 37 for the three vertices of these paths, but 15 000 for eight, where a picture of a hundred samples shows nothing of
    // what is rare and its own variance does not tell. So paths are shorter: the tail is heavy, the mean is the same.
    let mut fixed = Vec::new();
    for (way, p_guide) in [("random", 0.7), ("inverted", 0.7), ("one_direction", 0.5), ("one_cell", 0.0)] {
        fixed.push(format!(
            "<guide type='corrupted'><string name='way' value='{way}'/><float name='p_guide' value='{p_guide}'/>
             <string name='nee' value='kickstart'/></guide>"
        ));
    }
    let blind = blind.max(agree(&SCENES, &fixed, 4, 96));
    measured(
        "hc_p06_corrupted_guides_are_unbiased",
        format!(
            "{} corrupted guides in {} scenes agree; an error of {:.1} % of the mean would be found",
            guides.len() + fixed.len(),
            SCENES.len(),
            100.0 * blind
        ),
    );
}

/// A probability of 1 means 0.95. Where the guide is wrong, what the BSDF finds then counts twenty times at every vertex, and
/// its second moment is 20^k after k of them: 400 here, with two, which a picture of 74 000 samples shows. With eight it
/// would be 2.6e10, and no picture would. A delta lobe beside others counts twenty times as well. So paths are short here,
/// and nothing is of glass.
#[test]
fn hc_p06_a_selection_probability_of_one_is_unbiased() {
    let wrong = |way: &str| {
        format!("<guide type='corrupted'><string name='way' value='{way}'/><float name='p_guide' value='1'/></guide>")
    };
    let right = guided(200, "<float name='p_guide' value='1'/>");
    let guides = [right, wrong("inverted"), wrong("random"), wrong("one_cell")];
    let scenes = [SCENES[0], SCENES[2]];
    let blind = agree(&scenes, &guides, 3, 128);
    measured(
        "hc_p06_a_selection_probability_of_one_is_unbiased",
        format!(
            "{} guides in {} scenes agree; an error of {:.1} % of the mean would be found",
            guides.len(),
            scenes.len(),
            100.0 * blind
        ),
    );
}

/// What was learnt with the very seeds of the pictures, and is kept.
#[test]
fn hc_p06_guides_from_files_are_unbiased() {
    const SPP: u32 = 64;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("guiding").join("unbiased");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let guide = guided(200, "");
    let scenes = [SCENES[0], SCENES[2]];
    for (name, text) in scenes {
        let scene = scene(text, &path(9, &guide));
        let shot = |seed: u32| {
            let path = folder.join(format!("{name} {seed}"));
            let with = |frozen: bool| {
                let path = path.clone();
                render_with(&scene, SPP, seed, |cx| cx.guide_file = Some(GuideFile { path, frozen })).0
            };
            with(false);
            with(true)
        };
        let shots: Vec<Image> = (0..SEEDS).map(shot).collect();
        let found = Measured::of(&shots, &["R", "G", "B"].map(str::to_owned)).expect("ten pictures of a size");
        let plain = pictures(text, &path(9, ""), 2 * SPP, 1000);
        let found = compare(&found, &plain, true, sidak(0.01, scenes.len())).expect("of a kind");
        assert!(found.agrees(), "{name}: {:?}", found.mean_difference());
    }
}

/// A sun as small as the real one, behind a pane: path tracing meets it once in a hundred thousand times, and so does a guide
/// that has to be taught by such paths. It is found where the environment is bright, and where photons come from.
#[test]
fn a_sun_behind_glass_is_found() {
    let text = PANE.replace("value=\"20\"", "value=\"0.5358\"");
    assert_ne!(text, PANE);
    let shots = |guide: &str| {
        let scene = scene(&text, &path(9, guide));
        (0..SEEDS).map(|seed| render(&scene, 96, seed, SampleOrder::PerSample).0).collect::<Vec<Image>>()
    };
    let without = |names: &[&str]| {
        let more: String = names.iter().map(|name| format!("<float name='{name}' value='0'/>")).collect();
        shots(&guided(200, &more))
    };
    // relMSE against the mean of the pictures that were guided with both: of all that are there, it has the least noise.
    let both = without(&[]);
    let n = both[0].data.len();
    let mean: Vec<f32> = (0..n).map(|i| both.iter().map(|shot| shot.data[i]).sum::<f32>() / SEEDS as f32).collect();
    let error = |shots: Vec<Image>| {
        let pairs = shots.iter().flat_map(|shot| shot.data.iter().zip(&mean));
        pairs.map(|(v, m)| f64::from((v - m).powi(2) / (m * m + 0.01))).sum::<f64>() / (n * shots.len()) as f64
    };
    let (neither, plain) = (error(without(&["environment", "photons"])), error(shots("")));
    for (name, other) in [("environment", "photons"), ("photons", "environment")] {
        let with = error(without(&[other]));
        let [than_neither, than_plain] = [neither, plain].map(|error| error / with);
        measured(
            "a_sun_behind_glass_is_found",
            format!(
                "{name}: relMSE {than_neither:.1} times less than without this, {than_plain:.1} times less than `path`"
            ),
        );
        assert!(than_neither > 5.0 && than_plain > 5.0, "{name} {with} {neither} {plain}");
    }
}

/// Where guiding cannot help it does not hurt: the sky is white all over, and things are diffuse. What is counted are
/// rays, for time is not the same on all machines.
#[test]
fn hc_p12_an_open_sky_is_hardly_worse_guided() {
    const SPP: u32 = 64;
    /// Sum of the variances of all pixels, times the rays of a sample.
    fn cost(integrator: &str) -> f64 {
        let scene = scene(include_str!("open.xml"), integrator);
        let shots: Vec<_> = (0..SEEDS).map(|seed| render(&scene, SPP, seed, SampleOrder::PerSample)).collect();
        let rays: u64 = shots.iter().map(|(_, report)| report.rays).sum();
        let values: Vec<Vec<f64>> =
            shots.iter().map(|(image, _)| image.data.iter().map(|v| f64::from(*v)).collect()).collect();
        let n = f64::from(SEEDS);
        let variance = |i: usize| {
            let mean = values.iter().map(|shot| shot[i]).sum::<f64>() / n;
            values.iter().map(|shot| (shot[i] - mean).powi(2)).sum::<f64>() / (n - 1.0)
        };
        (0..values[0].len()).map(variance).sum::<f64>() * rays as f64
    }
    let plain = cost(&path(9, ""));
    let mut found = Vec::new();
    for product in ["cosine", "resampling"] {
        let guide = guided(500, &format!("<string name='product' value='{product}'/>"));
        let ratio = cost(&path(9, &guide)) / plain;
        assert!(ratio < 1.25, "{product}: {ratio:.3}");
        found.push(format!("{ratio:.2} times with the product by {product}"));
    }
    measured("hc_p12_an_open_sky_is_hardly_worse_guided", format!("variance times rays {}", found.join(", ")));
}

/// Behind a cut-out lies nothing: how often a sample is transparent, and black with that, is not the guide's business.
#[test]
fn hc_p06_what_is_transparent_does_not_depend_on_the_guide() {
    const SPP: u32 = 256;
    let text = include_str!("cutout.xml");
    let mean = |guide: &str| {
        let scene = scene(text, &path(6, guide));
        let image = render(&scene, SPP, 3, SampleOrder::PerSample).0;
        let pixels = image.data.chunks_exact(image.data.len() / (24 * 24));
        let n = pixels.len() as f64;
        pixels.fold([0.0; 2], |[light, alpha], v| [light + f64::from(v[0]) / n, alpha + f64::from(v[3]) / n])
    };
    let [light, alpha] = mean("");
    for more in ["", "<string name='product' value='resampling'/>", "<string name='sets' value='primary_product'/>"] {
        let guide = guided(50, &format!("<float name='p_guide' value='0.7'/>{more}"));
        let [guided_light, guided_alpha] = mean(&guide);
        // 147 thousand samples of 0 or 1, and of light that hardly varies where it is not black.
        assert!((guided_alpha - alpha).abs() < 0.01, "{more}: alpha {guided_alpha}, without {alpha}");
        assert!((guided_light / light - 1.0).abs() < 0.03, "{more}: light {guided_light}, without {light}");
    }
}

/// Numbers that are spread evenly over the samples of a pixel: what one has taught guides others that depend on it.
#[test]
fn hc_p06_guided_paths_are_unbiased_with_sobol_numbers() {
    let scenes = SCENES.map(|(name, text)| (name, text.replace("type=\"independent\"", "type=\"sobol\"")));
    let scenes = scenes.each_ref().map(|(name, text)| (*name, text.as_str()));
    assert!(scenes.iter().all(|(_, text)| text.contains("sobol")));
    let guides = [guided(20, ""), guided(20, "<float name='prior' value='0'/>")];
    let blind = agree(&scenes, &guides, 9, 64);
    measured(
        "hc_p06_guided_paths_are_unbiased_with_sobol_numbers",
        format!(
            "{} settings in {} scenes agree; an error of {:.1} % of the mean would be found",
            guides.len(),
            scenes.len(),
            100.0 * blind
        ),
    );
}

/// The test of the test: a guide whose density is a tenth too low makes a picture too bright.
#[test]
fn a_density_that_is_wrong_would_be_found() {
    let guide = "<guide type='corrupted'><string name='way' value='wrong'/><float name='p_guide' value='0.9'/></guide>";
    let plain = pictures(SCENES[2].1, &path(9, ""), 192, 1000);
    let guided = pictures(SCENES[2].1, &path(9, guide), 192, 2000);
    assert!(!compare(&guided, &plain, true, 0.01).expect("of a kind").agrees());
}
