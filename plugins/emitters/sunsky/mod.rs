//! `sunsky`: the daylight of a clear sky.
//!
//! An environment of two parts. The sky is the model of Hosek and Wilkie 2012, "An analytic model for full spectral
//! sky-dome radiance"; its data set is that of the authors (3-clause BSD). The sun is the one of Hosek and Wilkie 2013,
//! "Adding a solar-radiance function to the Hošek–Wilkie skylight model", by a fit of our own (irradiance to 0.03 %,
//! limb to 0.3 %). Radiance is in W·m⁻²·sr⁻¹·nm⁻¹ divided by the integral of the CIE ȳ function, and is not clipped: a
//! low sun may be out of gamut and have a negative blue. Below the horizon everything is black, and so is all of it once
//! the sun has set.
//!
//! The zenith is +z. The sun stands where `sun_direction` says (world space), or where it is at a place and time: then
//! +x is south and +y is west, before `to_world`.
//!
//! | parameter | type | default | meaning |
//! |---|---|---|---|
//! | `turbidity` | float | 3 | haze, from 1 (pure air) to 10 |
//! | `albedo` | colour | 0.3 | of the ground, in [0, 1] |
//! | `sun_direction` | vector | unset | direction to the sun; excludes place and time |
//! | `latitude`, `longitude` | float | 35.6894, 139.6917 | degrees, north and east positive |
//! | `timezone` | float | 9 | hours ahead of universal time |
//! | `year`, `month`, `day` | integer | 2010, 7, 10 | date |
//! | `hour`, `minute`, `second` | float | 15, 0, 0 | time of day |
//! | `sun_scale`, `sky_scale` | float | 1, 1 | factors on radiance; 0 turns off |
//! | `sun_aperture` | float | 0.5358 | diameter of the sun in degrees; irradiance stays the same |
//! | `complex_sun` | boolean | false | darken the sun towards its limb |
//! | `to_world` | transform | identity | rotation of the dome |
//! | `sampling_weight` | float | 1 | relative chance of being picked |
//!
//! ```xml
//! <emitter type="sunsky">
//!     <float name="turbidity" value="4"/>
//!     <vector name="sun_direction" value="0.5, 0.2, 0.6"/>
//! </emitter>
//! ```

#[cfg(test)]
mod golden;
mod position;
mod sky;
mod sun;
mod sun_fit;

use lucerna_core::color::Rgb;
use lucerna_core::interfaces::{Emitter, EmitterFlags, LightPoint, LightSample};
use lucerna_core::math::{ONE_MINUS_EPSILON, Transform, Vec2, Vec3};
use lucerna_core::scene::{Built, Constructor, Failed, Param, Plugin, Properties, Slot};
use position::PlaceAndTime;
use sky::{DomeSampler, Sky};
use std::f32::consts::PI;
use std::sync::Arc;
use sun::Sun;

/// Table entry.
pub const PLUGIN: Plugin = Plugin {
    name: "sunsky",
    aliases: &[],
    summary: "sun and clear sky (Hosek and Wilkie)",
    params: &[&[
        Param::float("turbidity", 3.0, "haze of the air").range(1.0, 10.0),
        Param::rgb("albedo", Slot::Reflectance, 0.3, "albedo of the ground"),
        Param::vector_opt("sun_direction", "direction to the sun in world space; excludes place and time"),
        Param::float("latitude", 35.6894, "degrees, north positive"),
        Param::float("longitude", 139.6917, "degrees, east positive"),
        Param::float("timezone", 9.0, "hours ahead of universal time"),
        Param::int("year", 2010, "year").range(-4000.0, 10000.0),
        Param::int("month", 7, "month").range(1.0, 12.0),
        Param::int("day", 10, "day of the month").range(1.0, 31.0),
        Param::float("hour", 15.0, "hour of the day"),
        Param::float("minute", 0.0, "minute"),
        Param::float("second", 0.0, "second"),
        Param::float("sun_scale", 1.0, "factor on the sun's radiance").at_least(0.0),
        Param::float("sky_scale", 1.0, "factor on the sky's radiance").at_least(0.0),
        Param::float("sun_aperture", 0.5358, "diameter of the sun in degrees").between(0.0, 180.0),
        Param::bool("complex_sun", false, "darken the sun towards its limb"),
        Param::transform("to_world", "rotation of the dome"),
        Param::float("sampling_weight", 1.0, "relative chance of being picked").at_least(0.0),
    ]],
    build: Constructor::Emitter(build),
};

/// Parameters that say where the sun is by place and time.
const PLACE_AND_TIME: [&str; 9] =
    ["latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"];

fn build(p: &Properties<'_>) -> Built<dyn Emitter> {
    let to_world = p.transform("to_world")?;
    if !to_world.is_similarity() {
        return Err(p.error("to_world", "\"to_world\" of a sky may rotate, mirror and scale evenly, but not distort"));
    }
    let sun = local_sun_direction(p, &to_world)?;
    if sun.z <= 0.0 {
        p.warn("sun_direction", "the sun is below the horizon: the sky is black");
    }
    let clear_sky = ClearSky {
        turbidity: p.float("turbidity"),
        albedo: p.rgb("albedo"),
        sun,
        sun_scale: p.float("sun_scale"),
        sky_scale: p.float("sky_scale"),
        half_aperture: 0.5 * p.float("sun_aperture").to_radians(),
        limb_darkened: p.bool("complex_sun"),
    };
    let daylight = clear_sky.daylight().map_err(|e| p.error("albedo", e.to_string()))?;
    Ok(Arc::new(SunSky { to_world, daylight, sampling_weight: p.float("sampling_weight") }))
}

/// Unit direction to the sun in the dome's own space.
fn local_sun_direction(p: &Properties<'_>, to_world: &Transform) -> Result<Vec3, Failed> {
    let Some(direction) = p.vector_opt("sun_direction") else {
        let place = PlaceAndTime {
            latitude: p.double("latitude"),
            longitude: p.double("longitude"),
            timezone: p.double("timezone"),
            year: p.int("year"),
            month: p.int("month"),
            day: p.int("day"),
            hour: p.double("hour"),
            minute: p.double("minute"),
            second: p.double("second"),
        };
        return Ok(place.sun_direction());
    };
    for name in PLACE_AND_TIME {
        p.exclusive("sun_direction", name)?;
    }
    to_world
        .inverse_vector(direction)
        .try_normalize()
        .ok_or_else(|| p.error("sun_direction", "\"sun_direction\" has no length"))
}

/// What a clear sky is made from.
#[derive(Clone, Copy)]
struct ClearSky {
    turbidity: f32,
    albedo: Rgb,
    /// Unit direction to the sun.
    sun: Vec3,
    sun_scale: f32,
    sky_scale: f32,
    /// Radians.
    half_aperture: f32,
    limb_darkened: bool,
}

impl ClearSky {
    /// The light of it; `None` at night, and where both parts are turned off.
    fn daylight(&self) -> Result<Option<Daylight>, hw_skymodel::rgb::Error> {
        let dome = Sky::new(self.turbidity, self.albedo, self.sun, self.sky_scale)?;
        let day = self.sun.z > 0.0;
        let sky = (day && self.sky_scale > 0.0).then(|| DomeSampler::new(&dome)).flatten().map(|s| (dome, s));
        let sun = (day && self.sun_scale > 0.0)
            .then(|| Sun::new(self.turbidity, self.sun, self.sun_scale, self.half_aperture, self.limb_darkened));
        let sky_flux = sky.as_ref().map_or(0.0, |(_, sampler)| sampler.flux());
        let sun_flux = sun.as_ref().map_or(0.0, |sun| sun.irradiance().luminance().max(0.0));
        let p_sun = match (&sky, &sun) {
            (None, None) => return Ok(None),
            (Some(_), None) => 0.0,
            (None, Some(_)) => 1.0,
            // The sky is never left short of samples: it is all the light there is in the shadows, and noisier.
            (Some(_), Some(_)) => (sun_flux / (sun_flux + sky_flux)).clamp(MIN_P_SUN, MAX_P_SUN),
        };
        Ok(Some(Daylight { sky, sun, p_sun, flux: sky_flux + sun_flux }))
    }
}

/// Even a dim sun must be found: to hit it by chance is hopeless.
const MIN_P_SUN: f32 = 0.05;
/// See [`ClearSky::daylight`].
const MAX_P_SUN: f32 = 0.5;

/// Sun and sky in the dome's own space.
struct Daylight {
    sky: Option<(Sky, DomeSampler)>,
    sun: Option<Sun>,
    p_sun: f32,
    /// Luminance integrated over solid angle.
    flux: f32,
}

impl Daylight {
    fn radiance(&self, d: Vec3) -> Rgb {
        if d.z < 0.0 {
            return Rgb::BLACK;
        }
        let sky = self.sky.as_ref().map_or(Rgb::BLACK, |(sky, _)| sky.radiance(d));
        sky + self.sun.as_ref().map_or(Rgb::BLACK, |sun| sun.radiance(d))
    }

    fn sample(&self, u: Vec2) -> Option<Vec3> {
        let stretched = |x: f32| Vec2::new(x.min(ONE_MINUS_EPSILON), u.y);
        match (&self.sky, &self.sun) {
            (_, Some(sun)) if u.x < self.p_sun => Some(sun.sample(stretched(u.x / self.p_sun))),
            (Some((_, dome)), _) => Some(dome.sample(stretched((u.x - self.p_sun) / (1.0 - self.p_sun)))),
            _ => None,
        }
    }

    fn pdf(&self, d: Vec3) -> f32 {
        if d.z < 0.0 {
            return 0.0;
        }
        let sky = self.sky.as_ref().map_or(0.0, |(_, dome)| dome.pdf(d));
        let sun = self.sun.as_ref().map_or(0.0, |sun| sun.pdf(d));
        (1.0 - self.p_sun) * sky + self.p_sun * sun
    }
}

/// The emitter.
struct SunSky {
    to_world: Transform,
    /// `None` if it is black.
    daylight: Option<Daylight>,
    sampling_weight: f32,
}

impl SunSky {
    fn local(&self, d: Vec3) -> Vec3 {
        self.to_world.inverse_vector(d).normalize()
    }
}

impl Emitter for SunSky {
    fn flags(&self) -> EmitterFlags {
        EmitterFlags::ENVIRONMENT
    }

    fn sampling_weight(&self) -> f32 {
        self.sampling_weight
    }

    fn sample_direct(&self, _from: Vec3, u2: Vec2) -> Option<LightSample> {
        let daylight = self.daylight.as_ref()?;
        let d = self.to_world.vector(daylight.sample(u2)?).normalize();
        let point = LightPoint::of_environment(d);
        // Asked about the world direction, so that a sample at the sun's rim is told the same as a ray that hits it.
        let local = self.local(d);
        let pdf = daylight.pdf(local);
        let weight = daylight.radiance(local) / pdf;
        (pdf > 0.0).then_some(LightSample { point, p_error: Vec3::ZERO, pdf, weight, delta: false })
    }

    fn pdf_direct(&self, _from: Vec3, point: &LightPoint) -> f32 {
        self.daylight.as_ref().map_or(0.0, |daylight| daylight.pdf(self.local(point.d)))
    }

    fn background(&self, d: Vec3) -> Rgb {
        self.daylight.as_ref().map_or(Rgb::BLACK, |daylight| daylight.radiance(self.local(d)))
    }

    fn power(&self, _scene_center: Vec3, scene_radius: f32) -> f32 {
        PI * scene_radius * scene_radius * self.daylight.as_ref().map_or(0.0, |daylight| daylight.flux)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna_core::math::DMat4;

    fn afternoon() -> ClearSky {
        let sun = Vec3::new(0.6, 0.2, 0.5).normalize();
        ClearSky {
            turbidity: 3.0,
            albedo: Rgb::splat(0.3),
            sun,
            sun_scale: 1.0,
            sky_scale: 1.0,
            half_aperture: 0.2679f32.to_radians(),
            limb_darkened: false,
        }
    }

    fn emitter(clear_sky: ClearSky, to_world: DMat4) -> SunSky {
        let daylight = clear_sky.daylight().unwrap();
        SunSky { to_world: Transform::new(to_world).unwrap(), daylight, sampling_weight: 1.0 }
    }

    fn variants() -> Vec<SunSky> {
        let sky = afternoon();
        let turned = DMat4::from_rotation_y(1.0) * DMat4::from_rotation_x(-0.7);
        vec![
            emitter(sky, DMat4::IDENTITY),
            emitter(ClearSky { limb_darkened: true, half_aperture: 0.2, ..sky }, turned),
            emitter(ClearSky { sky_scale: 0.0, ..sky }, turned),
            emitter(ClearSky { sun_scale: 0.0, ..sky }, turned),
        ]
    }

    #[test]
    fn samples_estimate_the_flux() {
        for sky in variants() {
            let n = 256;
            let mean: f64 = (0..n * n)
                .filter_map(|i| {
                    let u2 = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
                    sky.sample_direct(Vec3::ZERO, u2).map(|s| f64::from(s.weight.luminance()))
                })
                .sum::<f64>()
                / f64::from(n * n);
            let flux = f64::from(sky.power(Vec3::ZERO, 1.0) / PI);
            assert!((mean / flux - 1.0).abs() < 4e-3, "{mean} instead of {flux}");
        }
    }

    #[test]
    fn black_below_the_horizon_and_at_night() {
        let day = emitter(afternoon(), DMat4::IDENTITY);
        let down = Vec3::new(0.6, 0.0, -0.8);
        assert_eq!(day.background(down), Rgb::BLACK);
        assert_eq!(day.pdf_direct(Vec3::ZERO, &LightPoint::of_environment(down)), 0.0);
        for z in [0.0, -0.3] {
            let night = emitter(ClearSky { sun: Vec3::new(1.0, 0.0, z).normalize(), ..afternoon() }, DMat4::IDENTITY);
            assert_eq!(night.background(Vec3::Z), Rgb::BLACK);
            assert!(night.sample_direct(Vec3::ZERO, Vec2::splat(0.3)).is_none());
            assert_eq!(night.power(Vec3::ZERO, 1.0), 0.0);
        }
    }

    #[test]
    fn a_setting_sun_is_cut_by_the_horizon() {
        let (sin, cos) = 0.1f32.to_radians().sin_cos();
        let sky = emitter(ClearSky { sun: Vec3::new(cos, 0.0, sin), ..afternoon() }, DMat4::IDENTITY);
        let at = |degrees: f32| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            sky.background(Vec3::new(cos, 0.0, sin)).r
        };
        assert!(at(0.2) > 100.0 * at(0.5) && at(0.5) > 0.0);
        assert_eq!(at(-0.05), 0.0);
    }
}
