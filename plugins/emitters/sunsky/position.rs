//! Where the sun stands at a place and time.

use lucerna_core::math::Vec3;

/// A place on Earth and a time of its clocks.
#[derive(Clone, Copy, Debug)]
pub struct PlaceAndTime {
    /// Degrees, north positive.
    pub latitude: f64,
    /// Degrees, east positive.
    pub longitude: f64,
    /// Hours that the clocks are ahead of universal time.
    pub timezone: f64,
    /// Gregorian year.
    pub year: i64,
    /// Month from 1.
    pub month: i64,
    /// Day from 1.
    pub day: i64,
    /// Hours since midnight; any number.
    pub hour: f64,
    /// Minutes to add.
    pub minute: f64,
    /// Seconds to add.
    pub second: f64,
}

impl PlaceAndTime {
    /// Unit direction to the sun: x points south, y west, z to the zenith (so the frame is left-handed on a map, as
    /// in the reference renderer). Below the horizon z is negative.
    ///
    /// The algorithm is that of Blanco-Muriel et al. 2001, "Computing the solar vector".
    pub fn sun_direction(&self) -> Vec3 {
        let hours = self.hour - self.timezone + (self.minute + self.second / 60.0) / 60.0;
        let days = self.days_since_2000(hours);

        let node = 2.1429 - 0.0010394594 * days;
        let anomaly = 6.2400600 + 0.0172019699 * days;
        let longitude =
            4.8950630 + 0.017202791698 * days + 0.03341607 * anomaly.sin() + 0.00034894 * (2.0 * anomaly).sin()
                - 0.0001134
                - 0.0000203 * node.sin();
        let obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * node.cos();

        let right_ascension = (obliquity.cos() * longitude.sin()).atan2(longitude.cos());
        let (sin_declination, cos_declination) = (obliquity.sin() * longitude.sin()).asin().sin_cos();

        let sidereal = 6.6974243242 + 0.0657098283 * days + hours;
        let hour_angle = (15.0 * sidereal + self.longitude).to_radians() - right_ascension;
        let (sin_hour, cos_hour) = hour_angle.sin_cos();
        let (sin_latitude, cos_latitude) = self.latitude.to_radians().sin_cos();

        // Equatorial to horizontal: components towards the south, the west and the zenith.
        let south = sin_latitude * cos_declination * cos_hour - cos_latitude * sin_declination;
        let west = cos_declination * sin_hour;
        let up = cos_latitude * cos_declination * cos_hour + sin_latitude * sin_declination;

        // Seen from the surface, not from the centre of the Earth, the sun is a little lower (parallax).
        const PARALLAX: f64 = 6371.01 / 149597890.0;
        let zenith = up.clamp(-1.0, 1.0).acos();
        let (sin_zenith, cos_zenith) = (zenith + PARALLAX * zenith.sin()).sin_cos();
        let (sin_azimuth, cos_azimuth) = west.atan2(south).sin_cos();
        Vec3::new((sin_zenith * cos_azimuth) as f32, (sin_zenith * sin_azimuth) as f32, cos_zenith as f32)
    }

    /// Days since noon of 1 January 2000, universal time.
    ///
    /// The day number is that of Fliegel and Van Flandern 1968. The reference renderer keeps it in single precision,
    /// which near day 2 451 545 knows quarters of a day only; the sun is some hundredths of a degree off for that, here
    /// as there, so that shadows fall on the same pixels.
    fn days_since_2000(&self, hours: f64) -> f64 {
        let shift = (self.month - 14) / 12;
        let day_number = 1461 * (self.year + 4800 + shift) / 4 + 367 * (self.month - 2 - 12 * shift) / 12
            - 3 * ((self.year + 4900 + shift) / 100) / 4
            + self.day
            - 32075;
        f64::from(day_number as f32 - 0.5 + hours as f32 / 24.0 - 2_451_545.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::golden;
    use super::*;

    #[test]
    fn agrees_with_the_reference() {
        for [latitude, longitude, timezone, year, month, day, hour, minute, second, x, y, z] in golden::POSITIONS {
            let (year, month, day) = (year as i64, month as i64, day as i64);
            let place = PlaceAndTime { latitude, longitude, timezone, year, month, day, hour, minute, second };
            let expected = Vec3::new(x as f32, y as f32, z as f32);
            let found = place.sun_direction();
            assert!((found.length() - 1.0).abs() < 1e-6);
            let degrees = (found - expected).length().to_degrees();
            assert!(degrees < 0.01, "{place:?}: {found} instead of {expected}, {degrees}° off");
        }
    }

    #[test]
    fn stands_in_the_south_at_noon_and_in_the_west_at_dusk() {
        let noon = PlaceAndTime {
            latitude: 50.0,
            longitude: 0.0,
            timezone: 0.0,
            year: 2021,
            month: 6,
            day: 21,
            hour: 12.0,
            minute: 0.0,
            second: 0.0,
        };
        let sun = noon.sun_direction();
        assert!(sun.x > 0.4 && sun.y.abs() < 0.02, "{sun}");
        assert!((sun.z.asin().to_degrees() - 63.4).abs() < 0.2, "{sun}");
        let dusk = PlaceAndTime { hour: 19.0, ..noon }.sun_direction();
        assert!(dusk.y > 0.8 && dusk.z > 0.0 && dusk.z < 0.3, "{dusk}");
    }
}
