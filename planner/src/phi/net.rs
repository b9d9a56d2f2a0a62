//! The network of a model file.

use super::encoder::{Encoder, RawOutputs};
use super::metadata::{ModelError, PhiMetadata, in_units};
use super::probe::{PARITY, difference, probe};
use crate::features::{ObserveError, ViewPlane, WiggleFeatures, observe};
use crate::observation::{Observation, ObservedPoints};
use crate::wiggle::wiggling_arm;
use shared_types::file_error::why;
use shared_types::rope::ROPE_PARAMETERS;
use std::path::Path;

/// What the network makes of one observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Parameters, order of [`shared_types::rope::RANGES`]; the link count is not
    /// rounded.
    pub parameters: [f64; ROPE_PARAMETERS],
    /// Their standard deviations as the network estimates them.
    pub std_dev: [f64; ROPE_PARAMETERS],
    /// How unlike the known ropes this one looks: near 1 for those, above
    /// [`PhiMetadata::out_of_distribution_limit`] for one in a hundred of them.
    pub out_of_distribution: f64,
}

/// Why there is no prediction.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// The film is none that the network can judge.
    #[error(transparent)]
    Observe(#[from] ObserveError),
    /// The features are not those the network was trained on, or so far off that the outputs
    /// are no numbers.
    #[error("{0}")]
    Features(String),
}

/// A loaded network.
#[derive(Debug)]
pub struct PhiNet {
    metadata: PhiMetadata,
    plane: ViewPlane,
    encoder: Encoder,
}

/// The network that comes with this version (`configs/models/README.md`).
const EMBEDDED: &[u8] = include_bytes!("../../../configs/models/phi-nn.onnx");

/// The wiggle that the network was trained on, as the camera sees it.
fn plane_of(metadata: &PhiMetadata) -> Result<ViewPlane, String> {
    let arm = wiggling_arm(&metadata.wiggle).map_err(|error| error.to_string())?;
    ViewPlane::of_motion(&arm, metadata.wiggle.filmed_s).map_err(|error| error.to_string())
}

impl PhiNet {
    /// The network that comes with this version; no released version fails to read it.
    pub fn embedded() -> Result<Self, ModelError> {
        Self::from_bytes("embedded", EMBEDDED)
    }

    /// Loads a model file.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| ModelError::new(&name, why(&error)))?;
        Self::from_bytes(&name, &bytes)
    }

    /// Loads a model from memory; `name` is for messages.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self, ModelError> {
        Self::read(bytes).map_err(|reason| ModelError::new(name, reason))
    }

    fn read(bytes: &[u8]) -> Result<Self, String> {
        let (metadata, weights) = PhiMetadata::read(bytes)?;
        let net = Self {
            encoder: Encoder::read(&weights, &metadata.features)?,
            plane: plane_of(&metadata)?,
            metadata,
        };
        net.try_out()?;
        Ok(net)
    }

    /// Asks it for the answer it must know, so that weights in another order show now.
    fn try_out(&self) -> Result<(), String> {
        let requested = probe(self.metadata.features);
        let answer = self.encoder.outputs(&requested.motion, &requested.widths);
        let expected = &self.metadata.probe;
        let off = difference(&expected.mean, &answer.mean)
            .max(difference(&expected.log_variance, &answer.log_variance));
        if off > PARITY {
            return Err(format!(
                "its answer to the test input is off by {off:.1e}, at most {PARITY:.0e} is allowed: export it again"
            ));
        }
        Ok(())
    }

    /// What the model says about itself.
    #[must_use]
    pub fn metadata(&self) -> &PhiMetadata {
        &self.metadata
    }

    /// Itself, if it reads what a camera shows.
    ///
    /// # Errors
    /// A network of link centres.
    pub fn for_camera(self) -> Result<Self, ObserveError> {
        self.reads(ObservedPoints::ArcLength).map(|()| self)
    }

    fn reads(&self, shown: ObservedPoints) -> Result<(), ObserveError> {
        use ObservedPoints::{ArcLength, LinkCentres};
        let reason = match (self.metadata.features.points, shown) {
            (ArcLength, ArcLength) | (LinkCentres, LinkCentres) => return Ok(()),
            (LinkCentres, ArcLength) => {
                "the network reads the centres of the rope's links, which only simulated films show (experiments sysid): name a network of keypoints uniform in arc length, or none for the built-in one"
            }
            (ArcLength, LinkCentres) => {
                "the film shows link centres, but the network reads keypoints uniform in arc length: name one trained with `points = \"link-centres\"`"
            }
        };
        Err(ObserveError::new(reason))
    }

    /// What the network sees of an observation of its wiggle.
    pub fn see(&self, observation: &Observation<'_>) -> Result<WiggleFeatures, ObserveError> {
        self.reads(observation.points)?;
        observe(
            self.metadata.features,
            observation.track,
            observation.appearance,
            observation.camera,
            &self.plane,
        )
    }

    /// Rope parameters behind an observation of its wiggle.
    pub fn look(&self, observation: &Observation<'_>) -> Result<Prediction, PredictError> {
        self.predict(&self.see(observation)?)
    }

    /// Rope parameters behind features.
    pub fn predict(&self, features: &WiggleFeatures) -> Result<Prediction, PredictError> {
        let out = self.run(features)?;
        let scales = &self.metadata.parameters;
        let (parameters, std_dev) = in_units(scales, &out.mean, &out.log_variance);
        Ok(Prediction {
            parameters,
            std_dev,
            out_of_distribution: f64::from(out.out_of_distribution),
        })
    }

    /// The network's outputs as they are.
    pub fn run(&self, features: &WiggleFeatures) -> Result<RawOutputs, PredictError> {
        if features.definition != self.metadata.features {
            return Err(PredictError::Features(format!(
                "the network was trained on {:?}, the observation has {:?}",
                self.metadata.features, features.definition
            )));
        }
        let found = self.encoder.outputs(&features.motion, &features.widths);
        found.is_finite().then_some(found).ok_or_else(|| {
            PredictError::Features("the network's outputs for this film are not finite".to_owned())
        })
    }
}
