"""Panel folders for the settings of tracker and search."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser

from app.control.controller import Controller
from tracker.errors import TrackerError
from tracker.motion.prediction import MAX_ORDER, PredictSettings
from tracker.search.best_first import SearchSettings
from tracker.tracking.chamfer.settings import Estimation, RecoverSettings, TrackSettings

_METHODS: dict[Estimation, str] = {"refine": "refine, else search", "search": "search alone (paper)"}
_ORDERS = ("stays", "constant velocity", "constant acceleration")
assert len(_ORDERS) == MAX_ORDER + 1


@dataclass(frozen=True)
class _Control:
    """A control of the panel; its kind follows from `options` and `bounds`."""

    name: str
    label: str
    hint: str
    options: tuple[str, ...] = ()
    """Choices of a dropdown."""
    bounds: tuple[float, float, float] | None = None
    """Least value, largest value and step of a number."""

    def add(self, gui: viser.GuiApi, value: Any) -> Any:
        """Add the control with a value, and return its handle."""
        if self.options:
            return gui.add_dropdown(self.label, self.options, initial_value=value, hint=self.hint)
        if self.bounds is not None:
            low, high, step = self.bounds
            return gui.add_number(self.label, value, min=low, max=high, step=step, hint=self.hint)
        if isinstance(value, bool):
            return gui.add_checkbox(self.label, value, hint=self.hint)
        return gui.add_text(self.label, value, hint=self.hint)


_FOLDERS: dict[str, tuple[_Control, ...]] = {
    "Track": (
        _Control("method", "method", "How the pose of a frame is found from its prediction", tuple(_METHODS.values())),
        _Control("order", "prediction", "Motion model of the prediction; the paper has constant acceleration", _ORDERS),
        _Control("window", "past poses", "Number of poses from which the motion is taken", bounds=(1, 8, 1)),
        _Control(
            "recover", "search lost limbs", "Search for a limb that is not where the edges and colours are"
        ),
        _Control(
            "backward_pass", "backward pass",
            "At the end of a run, track lost people backward from the first trusted poses after the loss",
        ),
    ),
    "Search": (
        _Control(
            "bound_deg", "bound, deg", "Largest change of an angle from the start of the search",
            bounds=(0.5, 90.0, 0.5),
        ),
        _Control(
            "bound_cm", "bound, cm", "Largest change of the position from the start of the search",
            bounds=(0.5, 100.0, 0.5),
        ),
        _Control("step_deg", "step, deg", "Spacing of the poses tried, along an angle", bounds=(0.5, 30.0, 0.5)),
        _Control("step_cm", "step, cm", "Spacing of the poses tried, along the position", bounds=(0.5, 30.0, 0.5)),
        _Control(
            "passes", "passes",
            "Factors on the steps: all stages are searched once per factor. The paper's mode is 1",
        ),
        _Control(
            "patience", "patience", "A stage ends after this many expansions without improvement", bounds=(1, 100, 1)
        ),
        _Control(
            "theta_px", "theta, px",
            "Edges farther away than this add nothing to the cost; 0 takes 3% of the longer side of the image",
            bounds=(0.0, 500.0, 1.0),
        ),
        _Control(
            "outliers", "outliers",
            "truncated: min(d, theta) over all points; paper: points beyond theta are left out",
            ("truncated", "paper"),
        ),
    ),
}  # fmt: skip


class SettingsPanel:
    """Two folders of the panel: settings of the tracker, and settings of the search."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the folders; entries go to the controller at once."""
        self._controller = controller
        shown = shown_of(controller.state.settings)
        self._controls: dict[str, Any] = {}
        for folder, controls in _FOLDERS.items():
            with server.gui.add_folder(folder, expand_by_default=False):
                self._controls |= {c.name: c.add(server.gui, shown[c.name]) for c in controls}

        async def changed(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:  # otherwise the program set it
                try:
                    self._controller.search.set_settings(self.read())
                except TrackerError as error:
                    event.client.add_notification("Settings", str(error), color="red", auto_close_seconds=8.0)

        for control in self._controls.values():
            control.on_update(changed)

    def show(self, settings: TrackSettings) -> None:
        """Show settings that changed elsewhere."""
        for name, value in shown_of(settings).items():
            if self._controls[name].value != value:
                self._controls[name].value = value

    def read(self) -> TrackSettings:
        """Return the settings that the panel shows."""
        return settings_of(
            {name: control.value for name, control in self._controls.items()}, self._controller.state.settings
        )


def shown_of(settings: TrackSettings) -> dict[str, Any]:
    """Return the values of the controls, by name, in degrees and centimetres. Inverse of `settings_of`."""
    search, predict = settings.search, settings.predict
    return {
        "method": _METHODS[settings.estimate],
        "order": _ORDERS[predict.order],
        "window": predict.window,
        "recover": settings.recover is not None,
        "backward_pass": settings.backward_pass,
        "bound_deg": round(float(np.degrees(search.bound_rad)), 6),
        "bound_cm": round(100 * search.bound_m, 6),
        "step_deg": round(float(np.degrees(search.step_rad)), 6),
        "step_cm": round(100 * search.step_m, 6),
        "passes": ", ".join(f"{p:g}" for p in search.passes),
        "patience": search.patience,
        "theta_px": settings.theta_px or 0.0,
        "outliers": settings.outliers,
    }


def settings_of(value: dict[str, Any], before: TrackSettings) -> TrackSettings:
    """Return settings with the values of the controls; other settings stay. Inverse of `shown_of`.

    Args:
        value: by name of the control, in degrees and centimetres.
        before: the present settings.

    Raises:
        TrackerError: the passes are not factors above 0 and up to 1.
    """
    search: SearchSettings = replace(
        before.search,
        bound_rad=float(np.radians(value["bound_deg"])),
        bound_m=value["bound_cm"] / 100,
        step_rad=float(np.radians(value["step_deg"])),
        step_m=value["step_cm"] / 100,
        passes=_passes(str(value["passes"])),
        patience=int(value["patience"]),
    )
    predict: PredictSettings = replace(before.predict, order=_ORDERS.index(value["order"]), window=int(value["window"]))
    return replace(
        before,
        estimate=next(key for key, label in _METHODS.items() if label == value["method"]),
        predict=predict,
        recover=(before.recover or RecoverSettings()) if value["recover"] else None,
        backward_pass=bool(value["backward_pass"]),
        search=search,
        theta_px=value["theta_px"] or None,
        outliers=value["outliers"],
    )


def _passes(text: str) -> tuple[float, ...]:
    try:
        passes = tuple(float(p) for p in text.split(",") if p.strip())
    except ValueError:
        passes = ()
    if not passes or not all(0 < p <= 1 for p in passes):
        raise TrackerError(f"expected passes as factors above 0 and up to 1, such as '1, 0.5, 0.25', found '{text}'")
    return passes
