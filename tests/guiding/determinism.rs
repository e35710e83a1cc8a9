//! The same bits for any number of threads, and for learning in between.

use super::{SCENES, guided, left_to_the_bsdf, scene};
use lucerna::core::render::{Budget, Control, RenderContext, Report};
use std::ops::ControlFlow;
use std::sync::Mutex;

/// Renders with so many threads and gives the picture's bits.
fn render(guide: &str, threads: usize, budget: Budget, control: &Control<'_>) -> (Report, Vec<u32>) {
    let integrator = format!("<integrator type='path'>{guide}</integrator>");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    pool.install(|| {
        let scene = scene(SCENES[1].1, &integrator);
        let integrator = scene.integrator().expect("there is one");
        let mut cx = RenderContext::new(&scene, &scene.sensors()[0], budget, 1, control, integrator.aov_names());
        let report = integrator.render(&mut cx).expect("it renders");
        let (_, data) = cx.store.develop(&cx.film);
        (report, data.iter().map(|v| v.to_bits()).collect())
    })
}

/// Every way of learning.
const WAYS: [&str; 6] = [
    "",
    "<string name='spatial_filter' value='box'/><string name='nee' value='kickstart'/>",
    "<string name='spatial_filter' value='nearest'/><string name='directional_filter' value='nearest'/>\
     <float name='p_guide' value='0.5'/>",
    "<string name='product' value='resampling'/>",
    "<string name='sets' value='direct_indirect'/>",
    "<string name='sets' value='primary_product'/><string name='spatial_filter' value='box'/>",
];

#[test]
fn hc_p08_the_number_of_threads_changes_no_bit() {
    let ways = WAYS.map(|way| (guided(100, way), 1 + usize::from(way.contains("sets"))));
    for (guide, notes) in ways.iter().chain([&(left_to_the_bsdf(100), 2)]) {
        let (_, one) = render(guide, 1, Budget::Samples(40), &Control::new());
        assert!(one.iter().any(|bits| f32::from_bits(*bits) > 0.0), "black");
        for threads in [2, 7] {
            let (report, bits) = render(guide, threads, Budget::Samples(40), &Control::new());
            assert!(report.spp == 40 && !report.stopped && report.notes.len() == *notes, "{:?}", report.notes);
            assert!(bits == one, "{threads} threads: {guide}");
        }
    }
}

#[test]
fn hc_p11_a_limit_of_memory_ends_refinement_but_not_the_run() {
    let guide = guided(10, "<float name='max_memory' value='0.2'/>");
    let (report, bits) = render(&guide, 2, Budget::Samples(64), &Control::new());
    assert!(report.spp == 64 && bits.iter().any(|bits| f32::from_bits(*bits) > 0.0));
    assert!(report.notes.iter().any(|note| note.contains("limit of memory")), "{:?}", report.notes);
}

#[test]
fn hc_p18_a_budget_below_one_pass_gives_a_picture() {
    for seconds in [0.0, 1e-6] {
        let control = Control::new().with_deadline(seconds);
        let (report, bits) = render(&guided(100, ""), 2, Budget::Seconds(seconds), &control);
        assert!(report.spp == 1 && bits.iter().any(|bits| f32::from_bits(*bits) > 0.0));
    }
}

/// Passes are told with what is there so far, and the run may be ended between them, also while it learns.
#[test]
fn hc_p18_a_run_is_looked_at_and_ended_while_it_learns() {
    let seen = Mutex::new(Vec::new());
    let watch = |end: lucerna::core::render::PassEnd<'_>| {
        let mean = end.store.pixel(3, 3).rgb;
        assert!(mean.is_finite());
        let mut seen = seen.lock().expect("no panic");
        seen.push(end.spp);
        if end.spp >= 21 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let control = Control::new().with_pass_end(&watch);
    let (report, bits) = render(&guided(100, ""), 2, Budget::Samples(100), &control);
    let seen = seen.lock().expect("no panic");
    assert!(report.stopped && report.spp == *seen.last().expect("passes were told") && report.spp >= 21);
    assert!(seen.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(bits.iter().any(|bits| f32::from_bits(*bits) > 0.0));
}
