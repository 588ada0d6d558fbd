from tca_mj.modules.bending import (
    SILICONE_SHEAR,
    SILICONE_YOUNG,
    BendingSpec,
    bending_module,
    silicone_cylinder,
    straight_module,
)
from tca_mj.modules.bistable import BistableSpec, bistable_module, shaped, snapping
from tca_mj.modules.continuum_leg import LegSpec
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.innervated import InnervatedFingerSpec, innervated_finger
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.modules.morphing_square import (
    Morphing3dSpec,
    TwistMorphingSpec,
    morphing_3d_module,
    square_spine,
    twist_morphing_module,
)
from tca_mj.modules.soft_finger import SoftFingerSpec
from tca_mj.modules.twisting import TwistingSpec, twisting_module

__all__ = [
    "BendingSpec", "BistableSpec", "FingerPairSpec", "InnervatedFingerSpec", "LegSpec",
    "Morphing3dSpec", "MorphingSpec", "SILICONE_SHEAR", "SILICONE_YOUNG", "SoftFingerSpec",
    "TwistMorphingSpec", "TwistingSpec", "bending_module", "bistable_module", "finger_pair",
    "innervated_finger", "morphing_3d_module", "morphing_module", "shaped", "silicone_cylinder",
    "snapping", "square_spine", "straight_module", "twist_morphing_module", "twisting_module",
]  # fmt: skip
