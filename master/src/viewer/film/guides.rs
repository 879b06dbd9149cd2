//! Guides of the denoiser for a film.

use std::sync::Arc;

use rayfarm_farm::{FinishedFrame, FrameId, ViewRequest};
use rayfarm_tracer::image::LinearImage;
use rayfarm_tracer::scene::Shading;
use rayfarm_tracer::{GUIDES, Guides};

use super::PassError;

/// The guides of a film, as far as they have been rendered.
#[derive(Clone, Debug, Default)]
pub(super) struct FilmGuides {
    /// The first pictures, until all are there.
    pictures: Vec<Arc<LinearImage>>,
    all: Option<Arc<Guides>>,
    /// Frames of the pictures.
    frames: Vec<FrameId>,
}

impl FilmGuides {
    /// Adds the guide that follows, in the order of [`GUIDES`], of the picture of a request.
    ///
    /// # Errors
    /// A frame of another view, or another guide; nothing is added.
    pub(super) fn add(
        &mut self,
        whole: &ViewRequest,
        shading: Shading,
        frame: &FinishedFrame,
    ) -> Result<(), PassError> {
        let expected = GUIDES.get(self.frames.len()) == Some(&shading);
        let picture =
            frame.linear().filter(|_| expected && frame.view == whole.auxiliary(shading).rendered());
        self.pictures.push(Arc::new(picture.ok_or(PassError::OtherView)?));
        self.frames.push(frame.frame);
        if let [albedo, normals, depth] = self.pictures.as_slice() {
            let all = Guides::new(albedo, normals, depth).map_err(|_| PassError::OtherView)?;
            self.all = Some(Arc::new(all));
            self.pictures = Vec::new();
        }
        Ok(())
    }

    /// The guides, once all of their pictures have been added.
    pub(super) fn all(&self) -> Option<&Arc<Guides>> {
        self.all.as_ref()
    }

    /// Frames of the pictures.
    pub(super) fn frames(&self) -> &[FrameId] {
        &self.frames
    }
}
