"""Remarks on a pose, for people to read. Several are joined by commas."""

from collections.abc import Sequence

from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import PosedBody
from tracker.estimation.fitting.hypothesis import Hypothesis, limbs_elsewhere

_UNCERTAIN = " uncertain"
_MAY_BE_ELSEWHERE = " may be elsewhere"


def uncertain(limb: str, reason: str = "") -> str:
    """Return the remark that the limb of a name may be off, with the reason, such as ` without LEFT`."""
    return f"{limb_display_name(limb)}{_UNCERTAIN}{reason}"


def may_be_elsewhere(body: PosedBody, others: Sequence[Hypothesis]) -> str:
    """Return the remark that other poses, with limbs elsewhere than in the pose of a body, are about as good."""
    moved = {name for other in others for name in limbs_elsewhere(body, other.body)}
    names = [limb_display_name(limb.name) for limb in limbs(body.model) if limb.name in moved]
    return f"{' and '.join(names) or 'body'}{_MAY_BE_ELSEWHERE}"


def without_uncertainty(remark: str, alternatives: bool = False) -> list[str]:
    """Return the remarks that do not say that a limb may be off, nor that other poses are about as good.

    Args:
        remark: all, joined.
        alternatives: whether remarks on other poses are left out too.
    """
    left_out = (_UNCERTAIN, _MAY_BE_ELSEWHERE) if alternatives else (_UNCERTAIN,)
    return [r for r in remark.split(", ") if r and not any(words in r for words in left_out)]
