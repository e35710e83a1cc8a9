//! A scene as one method renders it.

use super::method::Method;
use super::{Options, Shot};
use crate::check::key::{digest, scene_hash};
use crate::check::reference;
use crate::pictures::{Rendered, Source, one_line, read, render};
use lucerna_core::render::FilmStore;
use lucerna_core::scene::write::{WriteOptions, to_xml};
use lucerna_core::scene::{ObjectKind, Parameter, Registry, Scene, Value, instantiate};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Memory of the largest picture in MiB, as of `render`.
const MOST_MIB: u64 = 16_384;

/// A scene, changed by a method and ready to be rendered.
pub struct Subject {
    path: PathBuf,
    /// Our scene. For a peer it tells the size and how its sampler rounds; its integrator need not be one of ours.
    scene: Scene,
    peer: Option<Peer>,
    /// Hash of all that the pictures depend on, the seed and the number of samples aside.
    pub key: String,
}

struct Peer {
    variant: String,
    text: String,
}

impl Subject {
    /// Reads the scene and changes it.
    ///
    /// # Errors
    /// If that cannot be done; one line.
    pub fn load(registry: &Registry, path: &Path, method: &Method, options: &Options) -> Result<Self, String> {
        let mut reading = options.reading.clone();
        for (name, value) in &method.defines {
            reading.defines.retain(|(known, _)| known != name);
            reading.defines.push((name.clone(), value.clone()));
        }
        let Source { mut description, files } = read(path, &reading).map_err(|e| one_line(&e))?;
        let content = scene_hash(path, &files)?;
        method.apply(&mut description, registry)?;
        if let Some(size) = options.size {
            description.resize_films(size, "--size");
        }
        let for_reference = method.variant.is_some();
        let text = to_xml(&description, &WriteOptions { for_reference, folder: None });
        let peer = match &method.variant {
            Some(variant) => {
                for node in method.integrator.iter().chain(&method.sampler).chain(&method.light_sampler) {
                    if !text.contains(&format!("type=\"{}\"", node.plugin)) {
                        return Err(format!("the reference has no {} \"{}\"", node.kind.tag(), node.plugin));
                    }
                }
                // Its integrators may be others than ours.
                let root = description.root;
                let known = |p: &Parameter| match p.value {
                    Value::Object(id) => {
                        let node = &description.nodes[id.0 as usize];
                        node.kind != ObjectKind::Integrator || registry.find(node.kind, &node.plugin).is_some()
                    }
                    _ => true,
                };
                let kept = description.node(root).parameters.iter().filter(|p| known(p)).cloned().collect();
                description.node_mut(root).parameters = kept;
                Some(Peer { variant: variant.clone(), text: text.clone() })
            }
            None => None,
        };
        let scene = instantiate(registry, description, reading.lenient).map_err(|e| one_line(&e))?.scene;
        if scene.sensors().is_empty() {
            return Err("the scene has no sensor".to_owned());
        }
        if scene.integrator().is_none() && peer.is_none() {
            return Err("the scene has no integrator".to_owned());
        }
        let film = scene.sensors()[0].film.settings().crop_size;
        let needed = FilmStore::bytes(film, scene.integrator().map_or(0, |i| i.aov_names().len())) >> 20;
        if needed > MOST_MIB {
            return Err(format!(
                "the picture needs {needed} MiB, the limit is {MOST_MIB} MiB (--size makes it smaller)"
            ));
        }
        let renderer = match &peer {
            Some(peer) => format!("{} {}", peer.variant, reference::version(path)?),
            None => program().to_owned(),
        };
        let key = json!({ "content": content, "text": text, "renderer": renderer });
        Ok(Subject { path: path.to_owned(), scene, peer, key: digest(key.to_string().as_bytes()) })
    }

    /// Width and height of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.scene.sensors()[0].film.settings().crop_size.to_array()
    }

    /// The largest number of samples per pixel that the sampler can take and is not above `most`, or the least it can.
    pub fn counts_up_to(&self, most: u32) -> u32 {
        let sampler = &self.scene.sensors()[0].sampler;
        let (mut low, mut high) = (0, most);
        while low < high {
            let middle = high - (high - low) / 2;
            if sampler.round_spp(middle) <= most {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        sampler.round_spp(low.max(1))
    }

    /// Renders pictures with one seed and these numbers of samples per pixel, each from the beginning.
    ///
    /// # Errors
    /// If the renderer gives up; one line.
    pub fn render(&self, counts: &[u32], seed: u32) -> Result<Vec<Shot>, String> {
        match &self.peer {
            Some(peer) => {
                let (size, variant) = (self.size(), &peer.variant);
                let answers = reference::render_text(&self.path, &peer.text, variant, counts, seed, size)
                    .map_err(|e| joined(&e))?;
                let shots = answers.into_iter().zip(counts);
                Ok(shots.map(|((image, seconds), spp)| Shot { spp: *spp, seconds, image }).collect())
            }
            None => counts.iter().map(|spp| self.render_here(*spp, seed)).collect(),
        }
    }

    fn render_here(&self, spp: u32, seed: u32) -> Result<Shot, String> {
        let Rendered { image, seconds, .. } = render(&self.scene, spp, seed, |_| ()).map_err(|e| joined(&e.0))?;
        Ok(Shot { spp, seconds, image })
    }
}

/// A hash of the running program: what another build rendered is not taken for what this one would.
fn program() -> &'static str {
    static HASH: OnceLock<String> = OnceLock::new();
    HASH.get_or_init(|| {
        let bytes = std::env::current_exe().and_then(std::fs::read);
        bytes.map_or_else(|_| env!("CARGO_PKG_VERSION").to_owned(), |bytes| digest(&bytes))
    })
}

fn joined(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
