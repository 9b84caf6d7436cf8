//! What is measured of a cloth: a trait, so that what is broken on purpose can be measured as well.

use glam::{DVec2, DVec3, Vec3};
use selvedge_yarn_brdf::{Batch, Footprint, Shader};

/// A surface that reflects, in three precisions: [`Shader`].
///
/// All functions are those of the shader. The slices of a batch are equally long.
pub(super) trait Surface: Send + Sync {
    /// [`Shader::eval`].
    fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3;

    /// [`Shader::eval_reference`].
    fn reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3;

    /// [`Shader::eval_batch`].
    fn eval_batch(&self, points: &Batch<'_>, f: [&mut [f32]; 3]);

    /// [`Shader::far_eval`].
    fn far_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3;
}

const EQUAL: &str = "the slices of a batch are equally long";

impl Surface for Shader {
    fn eval(&self, uv: DVec2, wi: Vec3, wo: Vec3) -> Vec3 {
        self.eval(uv, wi, wo)
    }

    fn reference(&self, uv: DVec2, wi: DVec3, wo: DVec3) -> DVec3 {
        self.eval_reference(uv, wi, wo)
    }

    fn eval_batch(&self, points: &Batch<'_>, f: [&mut [f32]; 3]) {
        self.eval_batch(points, f).expect(EQUAL);
    }

    fn far_eval(&self, footprint: &Footprint, wi: Vec3, wo: Vec3) -> Vec3 {
        self.far_eval(footprint, wi, wo)
    }
}
