"""The settings of searches and trackers in viser's panel."""

from dataclasses import replace
from typing import Any

import numpy as np
import viser

from app.control.controller import Controller
from tracker.errors import TrackerError
from tracker.motion.prediction import MOST_ORDER, PredictSettings
from tracker.search.best_first import SearchSettings
from tracker.tracking.chamfer.settings import Estimation, RecoverSettings, TrackSettings

_METHODS: dict[Estimation, str] = {"refine": "refine, else search", "search": "search alone (paper)"}
_ORDERS = ("stays", "constant velocity", "constant acceleration")
assert len(_ORDERS) == MOST_ORDER + 1


class SettingsPanel:
    """Two folders of the panel: what the tracker is told, and what a search is told."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the folders; what is entered goes to the controller at once."""
        self._server, self._controller = server, controller
        shown = shown_of(controller.state.settings)
        self._controls = {**self._add_tracking(shown), **self._add_search(shown)}

        async def changed(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:  # else the program set it
                try:
                    self._controller.set_settings(self.read())
                except TrackerError as error:
                    event.client.add_notification("Settings", str(error), color="red", auto_close_seconds=8.0)

        for control in self._controls.values():
            control.on_update(changed)

    def _add_tracking(self, shown: dict[str, Any]) -> dict[str, Any]:
        gui = self._server.gui
        with gui.add_folder("Track", expand_by_default=False):
            return {
                "method": gui.add_dropdown(
                    "method", tuple(_METHODS.values()), initial_value=shown["method"],
                    hint="How the pose of a frame is found from its prediction",
                ),
                "order": gui.add_dropdown(
                    "prediction", _ORDERS, initial_value=shown["order"],
                    hint="How motion is expected to go on; the paper has constant acceleration",
                ),
                "window": gui.add_number(
                    "past poses", shown["window"], min=1, max=8, step=1,
                    hint="Number of poses from which the motion is taken",
                ),
                "recover": gui.add_checkbox(
                    "search lost limbs", shown["recover"],
                    hint="Search anew for a limb that is not where the edges and colours are",
                ),
                "second_pass": gui.add_checkbox(
                    "second pass", shown["second_pass"],
                    hint="At the end of a run, follow whoever was lost back from the first trusted poses after it",
                ),
            }  # fmt: skip

    def _add_search(self, shown: dict[str, Any]) -> dict[str, Any]:
        gui = self._server.gui
        with gui.add_folder("Search", expand_by_default=False):
            return {
                "bound_deg": gui.add_number(
                    "bound, deg", shown["bound_deg"], min=0.5, max=90.0, step=0.5,
                    hint="Largest change of an angle from where the search begins",
                ),
                "bound_cm": gui.add_number(
                    "bound, cm", shown["bound_cm"], min=0.5, max=100.0, step=0.5,
                    hint="Largest change of the position from where the search begins",
                ),
                "step_deg": gui.add_number(
                    "step, deg", shown["step_deg"], min=0.5, max=30.0, step=0.5,
                    hint="Spacing of the poses tried, along an angle",
                ),
                "step_cm": gui.add_number(
                    "step, cm", shown["step_cm"], min=0.5, max=30.0, step=0.5,
                    hint="Spacing of the poses tried, along the position",
                ),
                "passes": gui.add_text(
                    "passes", shown["passes"],
                    hint="Factors on the steps: all stages are searched once per factor. The paper's mode is 1",
                ),
                "patience": gui.add_number(
                    "patience", shown["patience"], min=1, max=100, step=1,
                    hint="A stage ends after so many expansions that found nothing better",
                ),
                "theta_px": gui.add_number(
                    "theta, px", shown["theta_px"], min=0.0, max=500.0, step=1.0,
                    hint="Edges farther away than this say nothing; 0 takes 3% of the longer side of the image",
                ),
                "outliers": gui.add_dropdown(
                    "outliers", ("truncated", "paper"), initial_value=shown["outliers"],
                    hint="truncated: min(d, theta) over all points; paper: points beyond theta are left out",
                ),
            }  # fmt: skip

    def show(self, settings: TrackSettings) -> None:
        """Show settings that were changed elsewhere."""
        for name, value in shown_of(settings).items():
            if self._controls[name].value != value:
                self._controls[name].value = value

    def read(self) -> TrackSettings:
        """The settings that the panel shows."""
        return settings_of(
            {name: control.value for name, control in self._controls.items()}, self._controller.state.settings
        )


def shown_of(settings: TrackSettings) -> dict[str, Any]:
    """What the panel shows of settings, by name of the control; degrees and centimetres. Back: `settings_of`."""
    search, predict = settings.search, settings.predict
    return {
        "method": _METHODS[settings.estimate],
        "order": _ORDERS[predict.order],
        "window": predict.window,
        "recover": settings.recover is not None,
        "second_pass": settings.second_pass,
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
    """Turn what the panel shows into settings; what it does not show stays as it is.

    Args:
        value: by name of the control; degrees and centimetres.
        before: the settings until now.

    Raises:
        TrackerError: the passes are no factors.
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
        second_pass=bool(value["second_pass"]),
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
