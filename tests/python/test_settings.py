"""Settings: what modes give, what is refused and how the refusal reads."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from vlp_bpt import Filter, Mode, RenderSettings, SettingsError, Weighting
from vlp_bpt.settings import FROM_MODE, MODE_PRESETS, Device


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (Mode.PAPER, (1, 5, 1, 1, 1, False, False, Weighting.UNIFORM, 5000)),
        (Mode.BALANCED, (12, 16, 1, 8, 1, True, True, Weighting.BALANCE, 625)),
        (Mode.REFERENCE, (64, 64, 1, 8, 1, True, True, Weighting.BALANCE, 1250)),
    ],
)
def test_a_mode_fills_what_is_open(mode: Mode, expected: tuple[Any, ...]) -> None:
    settings = RenderSettings(mode=mode).resolved(100, 50)
    found = (
        settings.light_path_length,
        settings.eye_path_length,
        settings.vlp_connections,
        settings.vlp_candidates,
        settings.light_samples,
        settings.splats,
        settings.roulette,
        settings.weighting,
        settings.light_paths,
    )
    assert found == expected
    assert settings.hits


@pytest.mark.parametrize("mode", list(Mode))
def test_what_is_set_stays(mode: Mode) -> None:
    values: dict[str, Any] = {
        "light_path_length": 2,
        "eye_path_length": 3,
        "light_paths": 17,
        "vlp_connections": 0,
        "light_samples": 4,
        "splats": mode is Mode.PAPER,
        "roulette": mode is Mode.PAPER,
        "adaptive": mode is Mode.PAPER,
        "vlp_candidates": 3,
        "weighting": Weighting.POWER,
    }
    assert values.keys() == set(FROM_MODE)
    resolved = RenderSettings(mode=mode, **values).resolved(640, 480)
    assert {name: getattr(resolved, name) for name in values} == values


@pytest.mark.parametrize("mode", list(Mode))
@pytest.mark.parametrize("size", [(1, 1), (512, 512), (1920, 1080), (8192, 8192)])
def test_automatic_light_paths_fit_their_room(mode: Mode, size: tuple[int, int]) -> None:
    settings = RenderSettings(mode=mode).resolved(*size)
    wanted, room = size[0] * size[1] // MODE_PRESETS[mode].pixels_per_light_path, MODE_PRESETS[mode].light_vertices
    assert settings.light_paths == max(min(wanted, room // settings.light_path_length), 1)
    assert RenderSettings(mode=mode, light_paths=0).resolved(*size) == settings


def test_reference_traces_at_most_32768_light_paths() -> None:
    assert RenderSettings(mode=Mode.REFERENCE).resolved(512, 512).light_paths == 32768


@pytest.mark.parametrize(("mode", "expected"), [(Mode.PAPER, 64), (Mode.BALANCED, 8), (Mode.REFERENCE, 16)])
def test_automatic_light_paths_without_light_path_length(mode: Mode, expected: int) -> None:
    assert RenderSettings(mode=mode, light_path_length=0).resolved(8, 8).light_paths == expected


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("samples", 0, "samples = 0: must be from 1 to 2147483647"),
        ("samples", 2.5, "samples = 2.5: must be a whole number"),
        ("samples", True, "samples = True: must be a whole number"),
        ("samples", None, "samples = None: must be a whole number"),
        ("time_limit", -1.0, "time_limit = -1.0: must be from 0 to 1000000000"),
        ("time_limit", math.nan, "time_limit = nan: must be from 0 to 1000000000"),
        ("time_limit", "soon", "time_limit = 'soon': must be a number"),
        ("noise_threshold", -0.01, "noise_threshold = -0.01: must be from 0 to 1000000000"),
        ("noise_threshold", math.nan, "noise_threshold = nan: must be from 0 to 1000000000"),
        ("noise_threshold", "low", "noise_threshold = 'low': must be a number"),
        ("light_path_length", 65, "light_path_length = 65: must be from 0 to 64"),
        ("eye_path_length", 0, "eye_path_length = 0: must be from 1 to 64"),
        ("vlp_connections", -1, "vlp_connections = -1: must be from 0 to 1024"),
        ("filter_width", 0.0, "filter_width = 0.0: must be from 0.01 to 10"),
        ("seed", 2**32, "seed = 4294967296: must be from 0 to 4294967295"),
        ("splats", 1, "splats = 1: must be on or off"),
        ("hits", None, "hits = None: must be on or off"),
        ("hits", "yes", "hits = 'yes': must be on or off"),
        ("mode", "FAST", "mode = 'FAST': must be one of PAPER, BALANCED, REFERENCE"),
        ("weighting", "MAXIMUM", "weighting = 'MAXIMUM': must be one of UNIFORM, BALANCE, POWER"),
        ("filter", 3, "filter = 3: must be one of BOX, GAUSSIAN, BLACKMAN_HARRIS"),
        ("device", "GPU", "device = 'GPU': must be one of AUTO, CPU, CUDA, HYBRID"),
    ],
)
def test_a_bad_value_is_named(name: str, value: Any, message: str) -> None:
    settings = RenderSettings()
    setattr(settings, name, value)
    for check in (settings.validate, lambda: settings.resolved(8, 8), lambda: RenderSettings.from_dict({name: value})):
        with pytest.raises(SettingsError) as error:
            check()
        assert str(error.value) == message


def test_values_come_to_their_types() -> None:
    settings = RenderSettings(
        mode="PAPER", samples=np.int64(3), time_limit=2, splats=np.True_, weighting="POWER", device="CPU"
    )  # type: ignore[arg-type]
    settings.validate()
    assert settings.splats is True
    assert settings.mode is Mode.PAPER
    assert settings.weighting is Weighting.POWER
    assert settings.device is Device.CPU
    assert type(settings.samples) is int
    assert type(settings.time_limit) is float


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("sample", "did you mean samples?"),
        ("Light-Paths", "did you mean light_paths?"),
        ("filterwidth", "did you mean filter_width?"),
        ("xyzzy", "known settings: mode, samples,"),
    ],
)
def test_an_unknown_name_is_answered_with_the_closest(name: str, hint: str) -> None:
    for make in (lambda: RenderSettings.from_dict({name: 1}), lambda: RenderSettings.from_strings({name: "1"})):
        with pytest.raises(SettingsError, match=f"unknown setting '{name}': ") as error:
            make()
        assert hint in str(error.value)


def test_settings_from_text() -> None:
    texts = {
        "mode": "paper",
        "samples": " 12 ",
        "time_limit": "1.5",
        "filter": "box",
        "light_paths": "auto",
        "weighting": "None",
        "seed": "9",
    }
    expected = RenderSettings(mode=Mode.PAPER, samples=12, time_limit=1.5, filter=Filter.BOX, seed=9)
    assert RenderSettings.from_strings(texts) == expected


@pytest.mark.parametrize(("text", "value"), [("on", True), ("OFF", False), ("true", True), ("no", False), ("1", True)])
def test_switches_from_text(text: str, value: bool) -> None:
    assert RenderSettings.from_strings({"splats": text, "hits": text}) == RenderSettings(splats=value, hits=value)
    assert RenderSettings.from_strings({"splats": "auto"}).splats is None


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("samples", "many", "samples = 'many': must be a whole number"),
        ("samples", "1.5", "samples = '1.5': must be a whole number"),
        ("samples", "auto", "samples = 'auto': must be a whole number"),
        ("time_limit", "", "time_limit = '': must be a number"),
        ("time_limit", "inf", "time_limit = inf: must be from 0 to 1000000000"),
        ("splats", "maybe", "splats = 'maybe': must be on or off"),
        ("hits", "auto", "hits = 'auto': must be on or off"),
        ("mode", "slow", "mode = 'SLOW': must be one of PAPER, BALANCED, REFERENCE"),
    ],
)
def test_bad_text_is_named(name: str, text: str, message: str) -> None:
    with pytest.raises(SettingsError) as error:
        RenderSettings.from_strings({name: text})
    assert str(error.value) == message


@pytest.mark.parametrize(
    "settings", [RenderSettings(), RenderSettings(mode=Mode.REFERENCE, samples=5, light_samples=2, splats=False)]
)
def test_settings_survive_a_dictionary(settings: RenderSettings) -> None:
    values = settings.to_dict()
    assert all(type(value) in (str, int, float, bool, type(None)) for value in values.values())
    assert RenderSettings.from_dict(values) == settings
    assert RenderSettings.from_dict(settings.resolved(9, 9).to_dict()).resolved(9, 9) == settings.resolved(9, 9)
