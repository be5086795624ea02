"""A Gaussian prior with correlations, which stands for evidence whose best pose and covariance are known."""

from dataclasses import dataclass

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import NormalEquations
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class GaussianPrior:
    """Gaussian prior on a pose whose degrees of freedom are correlated, such as an estimate by other evidence."""

    pose: Array
    """Mean of the prior, (n_values,)."""
    information: Array
    """Inverse of its covariance, (n_dofs, n_dofs)."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        r = model.difference(pose, self.pose)
        force = self.information @ r
        return NormalEquations(0.5 * float(r @ force), force, self.information)
