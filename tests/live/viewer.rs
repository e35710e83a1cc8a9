//! `--tev`, with a viewer that takes packets apart.

use crate::{picture, run, temporary};
use std::collections::HashMap;
use std::io::Read;
use std::net::TcpListener;

/// What a viewer knows of a picture.
#[derive(Default)]
struct Shown {
    size: [usize; 2],
    channels: Vec<String>,
    values: HashMap<String, Vec<f32>>,
}

/// Reads fields of a packet.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.0.split_first_chunk::<N>().expect("a field");
        self.0 = rest;
        *first
    }

    fn int(&mut self) -> usize {
        usize::try_from(i32::from_le_bytes(self.take())).expect("a count")
    }

    fn long(&mut self) -> usize {
        usize::try_from(i64::from_le_bytes(self.take())).expect("a count")
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|b| *b == 0).expect("an end");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }

    fn names(&mut self) -> Vec<String> {
        (0..self.int()).map(|_| self.text()).collect()
    }
}

/// Takes all packets until the renderer closes; gives the pictures by name, and the kinds of the packets.
fn view(mut bytes: &[u8]) -> (HashMap<String, Shown>, Vec<u8>) {
    let (mut shown, mut kinds) = (HashMap::<String, Shown>::new(), Vec::new());
    while !bytes.is_empty() {
        let length = u32::from_le_bytes(bytes[..4].try_into().expect("a length")) as usize;
        let mut fields = Fields(&bytes[4..length]);
        bytes = &bytes[length..];
        let [kind] = fields.take();
        kinds.push(kind);
        match kind {
            2 => drop(shown.remove(&fields.text())),
            4 => {
                let [_] = fields.take();
                let name = fields.text();
                let size = [fields.int(), fields.int()];
                let channels = fields.names();
                let values = channels.iter().map(|c| (c.clone(), vec![f32::NAN; size[0] * size[1]])).collect();
                shown.insert(name, Shown { size, channels, values });
            }
            6 => {
                let [_] = fields.take();
                let shown = shown.get_mut(&fields.text()).expect("a picture that was created");
                let channels = fields.names();
                let [x0, y0, width, height] = [(); 4].map(|()| fields.int());
                let offsets: Vec<usize> = channels.iter().map(|_| fields.long()).collect();
                let strides: Vec<usize> = channels.iter().map(|_| fields.long()).collect();
                let data: Vec<f32> =
                    fields.0.chunks(4).map(|b| f32::from_le_bytes(b.try_into().expect("floats"))).collect();
                fields.0 = &[];
                for (c, name) in channels.iter().enumerate() {
                    let to = shown.values.get_mut(name).expect("a channel that was created");
                    for i in 0..width * height {
                        to[(y0 + i / width) * shown.size[0] + x0 + i % width] = data[offsets[c] + i * strides[c]];
                    }
                }
            }
            other => panic!("packet of kind {other}"),
        }
        assert!(fields.0.is_empty(), "packet of kind {kind} has {} bytes too many", fields.0.len());
    }
    (shown, kinds)
}

/// A picture of more than one packet, from the first pass to the last: in the end the viewer has the floats of the file.
#[test]
fn the_viewer_has_the_floats_of_the_file() {
    let folder = temporary("tev");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let viewer = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        listener.accept().expect("a connection").0.read_to_end(&mut bytes).expect("packets");
        view(&bytes)
    });
    let (code, stderr) = run(&folder, &["-D", "res=300", "--spp", "6", "--tev", &address, "-o", "box.exr"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(!stderr.contains("warning"), "{stderr}");
    let (shown, kinds) = viewer.join().expect("a viewer");
    let shown = &shown["box.exr"];
    assert_eq!(shown.size, [300, 300]);
    assert_eq!(&kinds[..2], &[2, 4]);
    assert!(kinds.iter().filter(|kind| **kind == 6).count() >= 2, "{kinds:?}");
    let (_, _, values) = picture(&folder.join("box.exr"));
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert!(shown.channels.iter().any(|n| n == name));
        let expected: Vec<f32> = values.iter().skip(c).step_by(3).copied().collect();
        assert!(shown.values[name] == expected, "{name} differs");
    }
}

/// A viewer that is not there, hangs up, or is no address: a line, and the picture all the same.
#[test]
fn a_viewer_that_is_gone_stops_nothing() {
    let folder = temporary("tev_gone");
    let closed = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address").to_string();
    let rendered = |address: &str, name: &str| {
        let (code, stderr) = run(&folder, &["-q", "-D", "res=400", "--spp", "3", "--tev", address, "-o", name]);
        assert_eq!(code, 0, "{stderr}");
        let warnings = stderr.lines().filter(|l| l.starts_with("warning: tev at ")).count();
        assert!(warnings == 1 && stderr.lines().count() == 1, "{stderr}");
        picture(&folder.join(name)).2
    };
    let without = rendered(&closed, "closed.exr");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let viewer = std::thread::spawn(move || {
        // Takes a little and goes.
        let _ = listener.accept().expect("a connection").0.read_exact(&mut [0; 100]);
    });
    assert!(rendered(&address, "gone.exr") == without);
    viewer.join().expect("a viewer");
    assert!(rendered("no.such.host.invalid:14158", "nowhere.exr") == without);
    let (code, stderr) = run(&folder, &["--tev", "nowhere"]);
    assert!(code == 2 && stderr.contains("HOST:PORT"), "{stderr}");
}
