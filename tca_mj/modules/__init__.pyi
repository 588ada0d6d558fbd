from tca_mj.modules.bending import (
    SILICONE_SHEAR,
    SILICONE_YOUNG,
    BendingSpec,
    bending_module,
    silicone_cylinder,
    straight_module,
)
from tca_mj.modules.continuum_leg import LegSpec
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.innervated import InnervatedFingerSpec, innervated_finger
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.modules.soft_finger import SoftFingerSpec
from tca_mj.modules.twisting import TwistingSpec, twisting_module

__all__ = [
    "BendingSpec", "FingerPairSpec", "InnervatedFingerSpec", "LegSpec", "MorphingSpec",
    "SILICONE_SHEAR", "SILICONE_YOUNG", "SoftFingerSpec", "TwistingSpec", "bending_module",
    "finger_pair", "innervated_finger", "morphing_module", "silicone_cylinder", "straight_module",
    "twisting_module",
]  # fmt: skip
