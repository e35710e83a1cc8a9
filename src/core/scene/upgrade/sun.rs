//! Where the sun stands, in the frame of the skies of 0.x.

use glam::DVec3;

/// A place on Earth and a moment there.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceAndTime {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
    /// Hours ahead of Greenwich.
    pub timezone: f64,
    pub year: f64,
    pub month: f64,
    pub day: f64,
    /// Local time in hours, minutes and seconds in it.
    pub hour: f64,
}

impl PlaceAndTime {
    /// Days since noon of 1 January 2000 in Greenwich, and the hour of the day there.
    fn days_and_hour(&self) -> (f64, f64) {
        let hour = self.hour - self.timezone;
        // Years are counted from March, so that the day added in leap years is their last.
        let shift = f64::from(u8::from(self.month <= 2.0));
        let (year, month) = (self.year - shift, self.month + 12.0 * shift - 3.0);
        let before_year = 365.0 * year + (year / 4.0).floor() - (year / 100.0).floor() + (year / 400.0).floor();
        let before_month = ((153.0 * month + 2.0) / 5.0).floor();
        // 730 426 is the number of 1 January 2000 in this count.
        (before_year + before_month + self.day - 730_426.0 - 0.5 + hour / 24.0, hour)
    }

    /// The unit vector to the sun, with +X in the east, +Y up and +Z in the south.
    ///
    /// Blanco-Muriel, Alarcón-Padilla, López-Moratalla and Lara-Coira 2001, "Computing the solar vector", without the
    /// range reductions, which sine and cosine do not need. Good to half a minute of arc from 1999 to 2015, and to what
    /// a sky needs for centuries around.
    pub fn sun(&self) -> DVec3 {
        let (days, hour) = self.days_and_hour();
        let omega = 2.1429 - 0.001_039_459_4 * days;
        let mean_longitude = 4.895_063 + 0.017_202_791_698 * days;
        let anomaly = 6.240_06 + 0.017_201_969_9 * days;
        let longitude = mean_longitude + 0.033_416_07 * anomaly.sin() + 0.000_348_94 * (2.0 * anomaly).sin()
            - 0.000_113_4
            - 0.000_020_3 * omega.sin();
        let obliquity = 0.409_092_8 - 6.214e-9 * days + 0.000_039_6 * omega.cos();
        let right_ascension = (obliquity.cos() * longitude.sin()).atan2(longitude.cos());
        let declination = (obliquity.sin() * longitude.sin()).asin();
        let sidereal_hours = 6.697_424_324_2 + 0.065_709_828_3 * days + hour;
        let hour_angle = (sidereal_hours * 15.0 + self.longitude).to_radians() - right_ascension;

        let (sin_latitude, cos_latitude) = self.latitude.to_radians().sin_cos();
        let (sin_declination, cos_declination) = declination.sin_cos();
        let (sin_hour, cos_hour) = hour_angle.sin_cos();
        let east = -cos_declination * sin_hour;
        let up = cos_latitude * cos_hour * cos_declination + sin_declination * sin_latitude;
        let south = sin_latitude * cos_hour * cos_declination - sin_declination * cos_latitude;
        DVec3::new(east, up, south).normalize_or(DVec3::Y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOKYO: PlaceAndTime = PlaceAndTime {
        latitude: 35.6894,
        longitude: 139.6917,
        timezone: 9.0,
        year: 2010.0,
        month: 7.0,
        day: 10.0,
        hour: 15.0,
    };

    #[test]
    fn days_since_2000() {
        let moment = |year, month, day| PlaceAndTime { year, month, day, hour: 12.0, timezone: 0.0, ..TOKYO };
        assert_eq!(moment(2000.0, 1.0, 1.0).days_and_hour().0, 0.0);
        assert_eq!(moment(2000.0, 3.0, 1.0).days_and_hour().0, 60.0);
        assert_eq!(moment(2001.0, 1.0, 1.0).days_and_hour().0, 366.0);
        assert_eq!(moment(1999.0, 12.0, 31.0).days_and_hour().0, -1.0);
    }

    /// The reference's suns at these hours, each a point on its disk of half a degree, turned into this frame.
    #[test]
    fn follows_the_sun_of_the_reference() {
        for (hour, x, y, z) in [
            (9.0, 0.615_405, 0.782_591, 0.093_954),
            (12.0, -0.053_686, 0.971_841, 0.229_442),
            (15.0, -0.691_266, 0.720_891, 0.049_677),
        ] {
            let angle = PlaceAndTime { hour, ..TOKYO }.sun().angle_between(DVec3::new(x, y, z)).to_degrees();
            assert!(angle < 0.28, "{hour}: {angle} degrees off");
        }
    }

    #[test]
    fn rises_in_the_east_and_passes_the_south() {
        let sun = |hour| PlaceAndTime { hour, ..TOKYO }.sun();
        assert!(sun(5.0).x > 0.7 && sun(18.0).x < -0.7);
        assert!(sun(12.0).z > 0.0 && sun(0.0).y < 0.0);
    }
}
