//! What each row of the table does, as pairs of old and new files that must come out the same.

use super::super::write::{WriteOptions, to_xml};
use super::super::{resolve, xml};
use super::*;
use std::path::PathBuf;

fn load(version: &str, body: &str) -> Description {
    let text = format!("<scene version=\"{version}\">{body}</scene>");
    let mut description = xml::load_str(&text, "a.xml", &xml::LoadOptions::default()).unwrap();
    resolve::resolve(&mut description).unwrap();
    upgrade(&mut description);
    description
}

/// An object and all below it as text, parameters sorted by name.
fn text(scene: &Description, id: NodeId) -> String {
    let node = scene.node(id);
    let mut parameters: Vec<String> = node
        .parameters
        .iter()
        .map(|p| match &p.value {
            Value::Object(child) => format!("{}={}", p.name, text(scene, *child)),
            Value::Float(number) => format!("{}={:.6}", p.name, number),
            value => format!("{}={value:?}", p.name),
        })
        .collect();
    parameters.sort();
    format!("{}:{}{{{}}}", node.kind.tag(), node.plugin, parameters.join(", "))
}

/// Checks that an old file means the same as a new one.
#[track_caller]
fn assert_reads(version: &str, old: &str, new: &str) {
    let (old, new) = (load(version, old), load("3.0.0", new));
    assert_eq!(text(&old, old.root), text(&new, new.root));
    assert!(!old.notes.is_empty());
}

#[test]
fn names_in_snake_case() {
    for (old, new) in [
        ("toWorld", "to_world"),
        ("intIOR", "int_ior"),
        ("kNN", "k_nn"),
        ("B", "B"),
        ("S", "S"),
        ("color0", "color0"),
        ("to_uv", "to_uv"),
    ] {
        assert_eq!(snake_case(old), new);
    }
}

#[test]
fn guided_path_with_all_its_parameters() {
    for (old, new) in [
        (
            "<integrator type='guided_path'><integer name='maxDepth' value='12'/><integer name='rrDepth' value='5'/>\
             <boolean name='strictNormals' value='true'/><boolean name='hideEmitters' value='true'/>\
             <string name='nee' value='kickstart'/><string name='sampleCombination' value='inversevar'/>\
             <string name='spatialFilter' value='stochastic'/><string name='directionalFilter' value='box'/>\
             <string name='bsdfSamplingFractionLoss' value='kl'/><float name='bsdfSamplingFraction' value='0.3'/>\
             <integer name='sTreeThreshold' value='4000'/><float name='dTreeThreshold' value='0.02'/>\
             <integer name='sdTreeMaxMemory' value='32'/><integer name='sppPerPass' value='1'/>\
             <boolean name='dumpSDTree' value='true'/><string name='budgetType' value='seconds'/>\
             <float name='budget' value='60'/></integrator>",
            "<integrator type='path'><integer name='max_depth' value='12'/><integer name='rr_depth' value='5'/>\
             <boolean name='hide_emitters' value='true'/><float name='timeout' value='60'/>\
             <guide name='_guide' type='sd_tree'><string name='nee' value='kickstart'/>\
             <string name='spatial_filter' value='stochastic'/><string name='directional_filter' value='box'/>\
             <string name='combination' value='inverse_variance'/><float name='least_gain' value='0'/>\
             <float name='learning' value='0.333'/><float name='spatial_threshold' value='2000'/>\
             <float name='directional_threshold' value='0.02'/><float name='max_memory' value='32'/>\
             <boolean name='direct' value='false'/><integer name='startup' value='0'/><string name='product' value='none'/>\
             <float name='roughness_threshold' value='0'/></guide></integrator>",
        ),
        (
            "<integrator type='guided_path'><string name='budgetType' value='spp'/><float name='budget' value='9'/>\
             </integrator><sensor type='perspective'><sampler type='independent'/></sensor>",
            "<integrator type='path'><guide name='_guide' type='sd_tree'><string name='nee' value='never'/>\
             <string name='spatial_filter' value='nearest'/><string name='directional_filter' value='nearest'/>\
             <string name='combination' value='last'/><string name='ending' value='variance'/><float name='p_guide' value='0.5'/>\
             <float name='learning' value='0.333'/><float name='spatial_threshold' value='6000'/>\
             <float name='directional_threshold' value='0.01'/>\
             <boolean name='direct' value='false'/><integer name='startup' value='0'/><string name='product' value='none'/>\
             <float name='roughness_threshold' value='0'/></guide></integrator>\
             <sensor type='perspective'><sampler type='independent'><integer name='sample_count' value='9'/></sampler></sensor>",
        ),
    ] {
        assert_reads("0.6.0", old, new);
    }
}

#[test]
fn integrators_samplers_films_sensors() {
    for (old, new) in [
        (
            "<integrator type='bdpt'><integer name='maxDepth' value='9'/><integer name='rrDepth' value='0'/>\
             <boolean name='lightImage' value='true'/></integrator>",
            "<integrator type='path'><integer name='max_depth' value='9'/><integer name='rr_depth' value='1'/></integrator>",
        ),
        (
            "<integrator type='mine'><float name='maxDepth' value='9'/></integrator>",
            "<integrator type='path'><integer name='max_depth' value='9'/></integrator>",
        ),
        (
            "<integrator type='sppm'/><medium type='homogeneous'/>",
            "<integrator type='volpath'/><medium type='homogeneous'/>",
        ),
        ("<integrator type='volpath_simple'/>", "<integrator type='volpath'/>"),
        (
            "<integrator type='irrcache'><float name='quality' value='1'/><integrator type='direct'>\
          <integer name='luminaireSamples' value='2'/><integer name='shadingSamples' value='1'/></integrator></integrator>",
            "<integrator type='direct'><integer name='emitter_samples' value='2'/></integrator>",
        ),
        (
            "<integrator type='path'><boolean name='strictNormals' value='true'/><boolean name='hideEmitters' value='true'/></integrator>",
            "<integrator type='path'><boolean name='hide_emitters' value='true'/></integrator>",
        ),
        (
            "<sampler type='halton'><integer name='sampleCount' value='16'/><integer name='scramble' value='-1'/></sampler>",
            "<sampler type='sobol'><integer name='sample_count' value='16'/></sampler>",
        ),
        (
            "<sampler type='ldsampler'><integer name='sampleCount' value='16'/><integer name='dimension' value='4'/></sampler>",
            "<sampler type='ldsampler'><integer name='sample_count' value='16'/></sampler>",
        ),
        (
            "<film type='ldrfilm'><integer name='width' value='4'/><string name='fileFormat' value='png'/>\
          <string name='pixelFormat' value='luminanceAlpha'/><float name='exposure' value='1'/><float name='gamma' value='-1'/>\
          <boolean name='highQualityEdges' value='true'/><string name='componentFormat' value='half'/>\
          <boolean name='banner' value='false'/><string name='toneMappingMethod' value='gamma'/><rfilter type='wsinc'/></film>",
            "<film type='hdrfilm'><integer name='width' value='4'/><string name='pixel_format' value='luminance_alpha'/>\
          <boolean name='sample_border' value='true'/><string name='component_format' value='float16'/><rfilter type='lanczos'/></film>",
        ),
        (
            "<film type='mfilm'><string name='fileFormat' value='matlab'/><string name='pixelFormat' value='rgb, luminance'/>\
          <integer name='cropOffsetX' value='3'/></film>",
            "<film type='hdrfilm'><string name='pixel_format' value='rgb'/><integer name='crop_offset_x' value='3'/></film>",
        ),
        (
            "<film type='hdrfilm'><rfilter type='gaussian'><float name='halfSize' value='2'/><float name='stddev' value='1'/></rfilter></film>",
            "<film type='hdrfilm'><rfilter type='gaussian'><float name='stddev' value='1'/></rfilter></film>",
        ),
        (
            "<sensor type='perspective_rdist'><string name='kc' value='0'/><float name='nearClip' value='1'/>\
          <string name='fovAxis' value='smaller'/><float name='focusDistance' value='2'/></sensor>",
            "<sensor type='perspective'><float name='near_clip' value='1'/><string name='fov_axis' value='smaller'/>\
          <float name='focus_distance' value='2'/></sensor>",
        ),
        (
            "<sensor type='telecentric'><float name='apertureRadius' value='1'/></sensor>",
            "<sensor type='orthographic'/>",
        ),
    ] {
        assert_reads("0.6.0", old, new);
    }
}

#[test]
fn emitters() {
    for (old, new) in [
        (
            "<emitter type='area'><float name='scale' value='3'/><rgb name='radiance' value='1 2 3'/><float name='samplingWeight' value='2'/></emitter>",
            "<emitter type='area'><rgb name='radiance' value='3 6 9'/><float name='sampling_weight' value='2'/></emitter>",
        ),
        (
            "<emitter type='spot'><float name='scale' value='3'/><float name='cutoffAngle' value='9'/></emitter>",
            "<emitter type='spot'><float name='intensity' value='3'/><float name='cutoff_angle' value='9'/></emitter>",
        ),
        (
            "<emitter type='sunsky'><float name='sunRadiusScale' value='2'/><float name='scale' value='5'/><float name='skyScale' value='2'/>\
          <vector name='sunDirection' x='0' y='1' z='0'/><integer name='resolution' value='9'/><float name='stretch' value='1'/>\
          <float name='turbidity' value='40'/></emitter>",
            "<emitter type='sunsky'><float name='sun_aperture' value='1.0716'/><float name='sun_scale' value='5'/><float name='sky_scale' value='10'/>\
          <vector name='sun_direction' x='0' y='1' z='0'/><float name='turbidity' value='10'/>\
          <transform name='to_world'><matrix value='1 0 0 0 0 0 1 0 0 -1 0 0 0 0 0 1'/></transform></emitter>",
        ),
        (
            "<emitter type='sky'><float name='scale' value='2'/><vector name='sunDirection' x='0' y='1' z='0'/><transform name='toWorld'><translate x='5'/></transform></emitter>",
            "<emitter type='sunsky'><float name='sun_scale' value='0'/><float name='sky_scale' value='2'/><vector name='sun_direction' x='0' y='1' z='0'/>\
          <transform name='to_world'><matrix value='1 0 0 5 0 0 1 0 0 -1 0 0 0 0 0 1'/></transform></emitter>",
        ),
        (
            "<emitter type='sun'><vector name='sunDirection' x='0' y='1' z='0'/><float name='hour' value='9'/></emitter>",
            "<emitter type='sunsky'><float name='sky_scale' value='0'/><vector name='sun_direction' x='0' y='1' z='0'/>\
          <transform name='to_world'><matrix value='1 0 0 0 0 0 1 0 0 -1 0 0 0 0 0 1'/></transform></emitter>",
        ),
        (
            "<emitter type='envmap'><float name='gamma' value='1'/><boolean name='cache' value='false'/><float name='scale' value='2'/></emitter>",
            "<emitter type='envmap'><float name='scale' value='2'/></emitter>",
        ),
    ] {
        assert_reads("0.6.0", old, new);
    }
}

#[test]
fn sun_and_sky_become_one() {
    assert_reads(
        "0.6.0",
        "<emitter type='sun' id='sun'><float name='scale' value='3'/><float name='sunRadiusScale' value='2'/></emitter>\
         <emitter type='sky'><vector name='sunDirection' x='0' y='1' z='0'/></emitter>",
        "<emitter type='sunsky' name='_arg_1'><float name='sun_scale' value='3'/><float name='sky_scale' value='1'/>\
         <float name='sun_aperture' value='1.0716'/><vector name='sun_direction' x='0' y='1' z='0'/>\
         <transform name='to_world'><matrix value='1 0 0 0 0 0 1 0 0 -1 0 0 0 0 0 1'/></transform></emitter>",
    );
}

#[test]
fn the_sky_turns_upright() {
    let scene = load("0.6.0", "<emitter type='sky'/>");
    let sky = scene.children(scene.root).next().unwrap().1;
    let Some(Value::Transform(matrix)) = scene.node(sky).parameter("to_world").map(|p| &p.value) else { panic!() };
    assert_eq!(matrix.transform_vector3(glam::DVec3::Z), glam::DVec3::Y);
    let turn = glam::DMat4::from_rotation_x(-90f64.to_radians());
    assert!(matrix.abs_diff_eq(turn, 1e-12));
}

#[test]
fn the_sun_of_a_place_and_time_turns_with_the_sky() {
    let body = "<emitter type='sunsky'><float name='hour' value='9'/><integer name='minute' value='0'/>\
                <transform name='toWorld'><rotate y='1' angle='90'/></transform></emitter>";
    let scene = load("0.5.0", body);
    let sky = scene.node(scene.children(scene.root).next().unwrap().1);
    let Some(Value::Vector(direction)) = sky.parameter("sun_direction").map(|p| &p.value) else { panic!() };
    let off = glam::DVec3::from_array(*direction).angle_between(glam::DVec3::new(0.093_954, 0.782_591, -0.615_405));
    assert!(off.to_degrees() < 0.28, "{direction:?}");
    assert!(sky.parameter("hour").is_none() && sky.parameter("minute").is_none());
}

#[test]
fn shapes_and_media() {
    for (old, new) in [
        (
            "<shape type='obj'><float name='maxSmoothAngle' value='9'/><boolean name='faceNormals' value='true'/><integer name='shapeIndex' value='1'/></shape>",
            "<shape type='obj'><boolean name='face_normals' value='true'/></shape>",
        ),
        (
            "<shape type='serialized'><float name='shapeIndex' value='1'/><float name='maxSmoothAngle' value='9'/></shape>",
            "<shape type='serialized'><integer name='shape_index' value='1'/></shape>",
        ),
        (
            "<shape type='sphere'><integer name='subdiv' value='9'/><boolean name='flipNormals' value='true'/></shape>",
            "<shape type='sphere'><boolean name='flip_normals' value='true'/></shape>",
        ),
        (
            "<shape type='cube'><medium name='interior' type='homogeneous'><rgb name='sigmaS' value='1 2 3'/><rgb name='sigmaA' value='1 2 3'/>\
          <float name='g' value='0.5'/><string name='strategy' value='balance'/></medium></shape>",
            "<shape type='cube'><medium name='interior' type='homogeneous'><float name='scale' value='6'/>\
          <rgb name='sigma_t' value='0.3333333333333333 0.6666666666666666 1'/><float name='albedo' value='0.5'/>\
          <phase type='hg' name='phase'><float name='g' value='0.5'/></phase></medium><bsdf type='null' name='bsdf'/></shape>",
        ),
        (
            "<medium type='homogeneous'><float name='sigmaA' value='2'/></medium>",
            "<medium type='homogeneous'><float name='sigma_t' value='2'/><float name='albedo' value='0'/></medium>",
        ),
        (
            "<medium type='heterogeneous'><volume type='gridvolume' name='density'><boolean name='sendData' value='true'/></volume>\
          <string name='method' value='woodcock'/><phase type='microflake'><float name='stddev' value='1'/></phase></medium>",
            "<medium type='heterogeneous'><volume type='gridvolume' name='sigma_t'/><phase type='isotropic'/></medium>",
        ),
        (
            "<phase type='mixturephase'><string name='weights' value='1, 3'/><phase type='isotropic'/><phase type='hg'/></phase>",
            "<phase type='blendphase'><float name='weight' value='0.75'/><phase type='isotropic'/><phase type='hg'/></phase>",
        ),
    ] {
        assert_reads("0.6.0", old, new);
    }
}

#[test]
fn materials() {
    for (old, new) in [
        (
            "<bsdf type='diffuse'><rgb name='diffuseReflectance' value='1 0 0'/></bsdf>",
            "<bsdf type='diffuse'><rgb name='reflectance' value='1 0 0'/></bsdf>",
        ),
        (
            "<bsdf type='roughdiffuse'><float name='reflectance' value='1'/><float name='alpha' value='1'/></bsdf>",
            "<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>",
        ),
        (
            "<bsdf type='difftrans'><float name='transmittance' value='1'/></bsdf>",
            "<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>",
        ),
        ("<bsdf type='lambertian'/>", "<bsdf type='diffuse'/>"),
        (
            "<bsdf type='phong'><float name='exponent' value='6'/><float name='diffuseReflectance' value='0.6'/><float name='specularReflectance' value='0.2'/></bsdf>",
            "<bsdf type='blendbsdf'><float name='weight' value='0.25'/><bsdf type='diffuse'><float name='reflectance' value='0.8'/></bsdf>\
          <bsdf type='roughconductor'><float name='specular_reflectance' value='0.8'/><string name='material' value='none'/><float name='alpha' value='0.5'/></bsdf></bsdf>",
        ),
        (
            "<bsdf type='ward'><float name='alphaU' value='0.1'/><float name='alphaV' value='0.4'/><texture type='bitmap' name='diffuseReflectance'/></bsdf>",
            "<bsdf type='roughplastic'><float name='alpha' value='0.2'/><float name='specular_reflectance' value='0.2'/><texture type='bitmap' name='diffuse_reflectance'/></bsdf>",
        ),
        (
            "<bsdf type='coating'><float name='thickness' value='1'/><float name='intIOR' value='1.5'/><bsdf type='diffuse'><rgb name='reflectance' value='1 0 0'/></bsdf></bsdf>",
            "<bsdf type='plastic'><float name='int_ior' value='1.5'/><rgb name='diffuse_reflectance' value='1 0 0'/></bsdf>",
        ),
        (
            "<bsdf type='roughcoating'><float name='alpha' value='0.3'/><bsdf type='roughconductor'><string name='material' value='Au'/></bsdf></bsdf>",
            "<bsdf type='roughconductor'><string name='material' value='Au'/></bsdf>",
        ),
        (
            "<bsdf type='mixturebsdf'><string name='weights' value='0.5, 0.2 0.1'/><bsdf type='plastic'/><bsdf type='conductor'/><bsdf type='dielectric'/></bsdf>",
            "<bsdf type='blendbsdf'><float name='weight' value='0.5'/><bsdf type='plastic'/><bsdf type='blendbsdf'><float name='weight' value='0.6'/>\
          <bsdf type='conductor'><string name='material' value='Cu'/></bsdf><bsdf type='blendbsdf'><float name='weight' value='0.66666667'/>\
          <bsdf type='dielectric'/><bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf></bsdf></bsdf></bsdf>",
        ),
        (
            "<bsdf type='mixturebsdf'><string name='weights' value='1'/><bsdf type='plastic'/></bsdf>",
            "<bsdf type='plastic'/>",
        ),
        (
            "<texture type='scale' id='s'><float name='scale' value='20'/><texture type='bitmap' id='b'/></texture>\
          <bsdf type='bumpmap'><ref id='s'/><bsdf type='diffuse'/></bsdf>",
            "<texture type='bitmap'/><bsdf type='bumpmap'><texture type='bitmap'/><bsdf type='diffuse'/><float name='scale' value='20'/></bsdf>",
        ),
        (
            "<bsdf type='normalmap'><texture type='bitmap'><float name='gamma' value='1'/></texture><bsdf type='diffuse'/></bsdf>",
            "<bsdf type='normalmap'><bsdf type='diffuse' name='_arg_1'/><texture type='bitmap' name='normalmap'><boolean name='raw' value='true'/></texture></bsdf>",
        ),
        (
            "<bsdf type='roughconductor'><float name='extEta' value='2'/><rgb name='eta' value='2 4 6'/><spectrum name='k' value='400:2, 500:4'/><string name='distribution' value='phong'/></bsdf>",
            "<bsdf type='roughconductor'><rgb name='eta' value='1 2 3'/><spectrum name='k' value='400:1, 500:2'/><string name='distribution' value='beckmann'/></bsdf>",
        ),
        (
            "<bsdf type='dielectric'><integer name='intIOR' value='2'/><string name='extIOR' value='air'/></bsdf>",
            "<bsdf type='dielectric'><float name='int_ior' value='2'/><string name='ext_ior' value='air'/></bsdf>",
        ),
        (
            "<bsdf type='roughplastic'><texture type='bitmap' name='alpha'/><float name='specularSamplingWeight' value='1'/></bsdf>",
            "<bsdf type='roughplastic'><float name='alpha' value='0.1'/></bsdf>",
        ),
        ("<bsdf type='conductor'/>", "<bsdf type='conductor'><string name='material' value='Cu'/></bsdf>"),
    ] {
        assert_reads("0.6.0", old, new);
    }
}

#[test]
fn textures() {
    for (old, new) in [
        (
            "<texture type='bitmap'><string name='filterType' value='ewa'/><float name='gamma' value='1.0'/><string name='wrapModeU' value='zero'/>\
          <string name='wrapModeV' value='clamp'/><float name='maxAnisotropy' value='9'/><boolean name='cache' value='true'/><string name='channel' value='r'/></texture>",
            "<texture type='bitmap'><string name='filter_type' value='bilinear'/><boolean name='raw' value='true'/><string name='wrap_mode' value='clamp'/></texture>",
        ),
        (
            "<texture type='bitmap'><float name='gamma' value='2.2'/><float name='uscale' value='2'/><float name='uoffset' value='0.25'/></texture>",
            "<texture type='bitmap'><transform name='to_uv'><translate x='0.25'/><scale x='2'/></transform></texture>",
        ),
        (
            "<texture type='checkerboard'><float name='uvscale' value='4'/><rgb name='brightColor' value='1 1 0'/><float name='darkColor' value='0'/></texture>",
            "<texture type='checkerboard'><transform name='to_uv'><scale x='4' y='4'/></transform><rgb name='color0' value='1 1 0'/><float name='color1' value='0'/></texture>",
        ),
        (
            "<texture type='scale'><float name='scale' value='2'/><texture type='checkerboard'><rgb name='color0' value='.1 .2 .3'/></texture></texture>",
            "<texture type='checkerboard'><rgb name='color0' value='.2 .4 .6'/><float name='color1' value='0.4'/></texture>",
        ),
        (
            "<texture type='scale'><float name='scale' value='2'/><texture type='bitmap'/></texture>",
            "<texture type='bitmap'/>",
        ),
        (
            "<texture type='vertexcolors'/>",
            "<texture type='mesh_attribute'><string name='name' value='vertex_color'/></texture>",
        ),
        (
            "<texture type='wireframe'><rgb name='interiorColor' value='1 0 0'/></texture>",
            "<texture type='checkerboard'><rgb name='color0' value='1 0 0'/><rgb name='color1' value='1 0 0'/></texture>",
        ),
        ("<texture type='ldrtexture'/>", "<texture type='bitmap'/>"),
    ] {
        assert_reads("0.6.0", old, new);
    }
    assert_reads(
        "2.2.1",
        "<texture type='uniform'><float name='lambda_min' value='400'/></texture>",
        "<texture type='uniform'><float name='wavelength_min' value='400'/></texture>",
    );
}

#[test]
fn new_files_are_left_alone() {
    let body = "<film type='ldrfilm'><float name='toWorld' value='1'/></film>";
    let scene = load("3.0.0", body);
    assert_eq!(text(&scene, scene.root), "scene:{_arg_0=film:ldrfilm{toWorld=1.000000}}");
    assert!(scene.notes.is_empty());
    assert_reads("3.0.0", "<integrator type='path_guiding_integrator'/>", "<integrator type='path'/>");
}

#[test]
fn notes_are_grouped() {
    let scene = load("0.5.0", "<film type='ldrfilm'/>\n<bsdf type='phong'/><bsdf type='phong'/><bsdf type='phong'/>");
    assert_eq!(
        scene.notes,
        [
            "film \"ldrfilm\" is read as \"hdrfilm\": the image stays linear (a.xml:1:24)",
            "bsdf \"phong\" is read as \"diffuse\" and \"roughconductor\" in \"blendbsdf\": the nearest that there is \
             today (a.xml:2:1 and 2 more)",
        ]
    );
}

/// Whatever is in a file, it is an error or a scene, and what is written of the scene loads again.
#[test]
fn damaged_files_do_no_harm() {
    let sound = "<scene version='0.6.0'><default name='n' value='2'/><bsdf type='mixturebsdf' id='m'>\
                 <string name='weights' value='0.5, $n'/><bsdf type='phong'/><bsdf type='coating'><ref id='d'/></bsdf>\
                 </bsdf><bsdf type='bumpmap' id='d'><texture type='scale'><float name='scale' value='2'/>\
                 <texture type='bitmap'><float name='uscale' value='$n'/></texture></texture><bsdf type='diffuse'/></bsdf>\
                 <emitter type='sky'><transform name='toWorld'><lookAt origin='0 0 0' target='1 2 3' up='0 1 0'/>\
                 </transform></emitter><shape type='cube'><medium type='homogeneous'><rgb name='sigmaS' value='1 2 3'/>\
                 </medium><ref id='m'/><spectrum name='s' value='400:1, 500:&#50;'/></shape></scene>";
    let mut random = 1u64;
    let mut next = |below: usize| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % below
    };
    let mut loaded = 0;
    for _ in 0..3000 {
        let mut text: Vec<char> = sound.chars().collect();
        for _ in 0..1 + next(3) {
            let (at, other) = (next(text.len()), next(text.len()));
            match next(4) {
                0 => text[at] = text[other],
                1 => drop(text.remove(at)),
                2 => text.insert(at, ['<', '>', '\'', '$', '&', '0', '-', 'é'][other % 8]),
                _ => drop(text.drain(at.min(other)..at.min(other) + (at.max(other) - at.min(other)).min(20))),
            }
        }
        let text: String = text.into_iter().collect();
        let Ok(mut scene) = xml::load_str(&text, "a.xml", &xml::LoadOptions::default()) else { continue };
        resolve::resolve(&mut scene).unwrap();
        upgrade(&mut scene);
        let again = to_xml(&scene, &WriteOptions::default());
        xml::load_str(&again, "b.xml", &xml::LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}\n{again}"));
        loaded += 1;
    }
    assert!(loaded > 100, "{loaded}");
}

/// Published scenes: those in the folders of `LUCERNA_SCENES`, if that is set.
fn published() -> Vec<PathBuf> {
    let folder = std::env::var_os("LUCERNA_SCENES").unwrap_or_default();
    let folders = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let files = folders.flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten().flatten());
    files.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "xml")).collect()
}

#[test]
fn published_scenes_load() {
    for path in published() {
        let scene = xml::load_upgraded(&path, &xml::LoadOptions::default()).unwrap_or_else(|errors| panic!("{errors}"));
        assert!(scene.warnings.is_empty(), "{}: {:?}", path.display(), scene.warnings);
        let today = scene.nodes.iter().flat_map(|node| &node.parameters).all(|p| p.name == snake_case(&p.name));
        assert!(today, "{}", path.display());
        assert_eq!(scene.notes.is_empty(), scene.version >= [3, 0, 0] && !path.ends_with("veach-mis/scene.xml"));
    }
}
