"""The front camera's pictures: labels are where `core.view` says, and what can be read is read."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flightd.core.camera_view import ForwardMount
from flightd.core.geometry import Lens
from flightd.core.types import CodeRead
from flightd.sim.plant.kinematics import Kinematics
from flightd.sim.racks.appearance import RackAppearance
from flightd.sim.racks.front_camera import FrontCamera
from flightd.sim.racks.rack_layout import faces
from flightd.sim.racks.renderer import FrontRenderer
from flightd.sim.racks.stock import Condition, Label, StockPlace, StockShares, StockSituation, stock
from flightd.sim.sensors.optics import Taking
from flightd.site.site import Side
from flightd.site.site_file import load_site
from flightd.vision.shelf.code_reader import read_codes

SITE = load_site(Path(__file__).parents[3] / "configs" / "site-racks-small.toml")
LOOK = RackAppearance(shares=StockShares(empty=0.15, tilted=0.15, torn=0.1, too_small=0.1, missing=0.05))
STILL = replace(LOOK, noise=0.0, flicker=0.0, motion_blur=False, soft_px=0.0, vignetting=0.0)
CAMERA = FrontCamera()
BARREL = Lens(1280, 800, 1000.0, 1000.0, 631.0, 405.0, (-0.12, 0.02, 0.0005, -0.0005, 0.0))
SEED = 3


@cache
def renderer() -> FrontRenderer:
    return FrontRenderer(SITE, CAMERA, LOOK, SEED)


@cache
def places() -> dict[str, StockPlace]:
    return dict(stock(SITE, LOOK.shares, CAMERA.lens.fx_px, SEED))


def facing(place: StockPlace, seq: int = 0, **changes: Any) -> Kinematics:
    """Hovering before the place's node at the height of its label, nose to the shelf, not quite still."""
    location = place.opening.location
    node = SITE.nodes[location.node]
    rng = np.random.default_rng([seq, len(location.code)])
    drift = rng.normal(0.0, (0.04, 0.04, 0.03, 0.012, 0.012, 0.02, 0.06, 0.06))
    yaw_rad = math.copysign(math.pi / 2, 1.0 if location.side is Side.RIGHT else -1.0)
    pose = Kinematics(
        stamp_ns=seq * 250_000_000,
        x_m=node.x_m + drift[0],
        y_m=node.y_m + drift[1],
        height_m=location.height_m + drift[2],
        vx_mps=drift[6],
        vy_mps=drift[7],
        climb_mps=0.0,
        roll_rad=drift[3],
        pitch_rad=drift[4],
        yaw_rad=yaw_rad + drift[5],
        roll_rate_radps=0.0,
        pitch_rate_radps=0.0,
        yaw_rate_radps=0.0,
    )
    return replace(pose, **changes)


def code_corners(place: StockPlace, label: Label) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """(4, 3) map points of the printed code's corners (without its quiet zone), top left first."""
    face = next(f for f in faces(SITE) if place.opening in f.openings)
    assert place.goods is not None
    width_m, _ = label.paper_size_m
    code_width_m, code_height_m = label.code_size_m
    quiet_m = label.symbol.symbology.quiet_modules * label.module_m
    top_m = label.paper_size_m[1] / 2 - quiet_m
    assert width_m == pytest.approx(code_width_m + 2 * quiet_m)
    c, s = math.cos(label.turn_rad), math.sin(label.turn_rad)
    points = []
    for right_m, up_m in (
        (-code_width_m / 2, top_m),
        (code_width_m / 2, top_m),
        (code_width_m / 2, top_m - code_height_m),
        (-code_width_m / 2, top_m - code_height_m),
    ):
        # turned clockwise as it is seen: what is right goes down
        along_m, above_m = c * right_m + s * up_m, c * up_m - s * right_m
        points.append(
            (
                place.opening.x_m + face.right * (label.right_m + along_m),
                face.y_m + face.inward * place.goods.recess_m,
                label.height_m + above_m,
            )
        )
    return np.array(points)


def read_corners(read: CodeRead, lens: Lens) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array(read.corners_px) + lens.centre_px


@pytest.mark.parametrize(
    "camera",
    [
        CAMERA,
        FrontCamera(lens=BARREL),
        FrontCamera(mount=ForwardMount(0.05, 0.04, (0.08, -0.03, 0.02))),
    ],
    ids=["ideal", "barrel", "mounted"],
)
def test_matrix_codes_are_found_where_the_geometry_puts_them(camera: FrontCamera) -> None:
    drawn = FrontRenderer(SITE, camera, STILL, SEED)
    found = 0
    for seq, place in enumerate(places().values()):
        label = place.labels[0] if place.labels else None
        if label is None or label.symbol.symbology.is_linear or not label.condition.is_readable:
            continue
        pose = facing(place, seq)
        reads = {read.text: read for read in read_codes(drawn.render(pose, seq), deeper=False)}
        read = reads.get(label.symbol.text)
        if read is None:
            continue
        expected = camera.view(pose).project(code_corners(place, label))
        # the reader counts from the pixels' edges, and tells the far corners up to a module off
        error_px = read_corners(read, camera.lens) - 0.5 - expected
        assert np.linalg.norm(error_px[[0, 3]], axis=1).max() < 2.0, (place.code, error_px)
        assert np.linalg.norm(error_px.mean(axis=0)) < 1.5, (place.code, error_px)
        found += 1
        if found == 6:
            return
    raise AssertionError(f"only {found} codes were found")


def pictures() -> Iterator[tuple[list[StockPlace], dict[str, CodeRead]]]:
    """Every place of the site, two to a picture, and what is believed of each picture."""
    stops: dict[tuple[object, ...], list[StockPlace]] = {}
    for place in places().values():
        location = place.opening.location
        stops.setdefault((location.node, location.side, location.level), []).append(place)
    for seq, here in enumerate(stops.values()):
        picture = renderer().render(facing(here[0], seq), seq)
        yield here, {read.text: read for read in read_codes(picture) if read.believed}


@pytest.mark.slow
def test_readable_labels_are_read_and_nothing_else_is_made_up() -> None:
    hanging = {label.symbol.text for place in places().values() for label in place.labels}
    unread, wrong, beyond = [], [], []
    for here, reads in pictures():
        wrong += [text for text in reads if text not in hanging | SITE.locations.keys()]
        for label in (label for place in here for label in place.labels):
            if label.condition.is_readable and label.symbol.text not in reads:
                unread.append(label)
            if not label.condition.is_readable and label.symbol.text in reads:
                beyond.append(label)
    assert wrong == []
    assert beyond == []
    assert unread == []


def test_the_beam_carries_the_codes_of_its_locations() -> None:
    place = next(iter(places().values()))
    picture = renderer().render(facing(place, 1), 1)
    texts = {read.text for read in read_codes(picture)}
    assert place.code in texts
    bare = FrontRenderer(SITE, CAMERA, replace(LOOK, location_labels=False), SEED)
    assert not {r.text for r in read_codes(bare.render(facing(place, 1), 1))} & SITE.locations.keys()


def test_a_picture_does_not_depend_on_what_was_rendered_before() -> None:
    first, *_, last = places().values()
    fresh = FrontRenderer(SITE, CAMERA, LOOK, SEED).render(facing(last, 2), 2)
    renderer().render(facing(first, 1), 1)
    assert np.array_equal(renderer().render(facing(last, 2), 2), fresh)


def test_an_empty_place_is_dark_and_not_flat() -> None:
    empty = next(p for p in places().values() if p.situation is StockSituation.EMPTY)
    full = next(p for p in places().values() if p.situation is StockSituation.MISSING)

    def inside(place: StockPlace) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
        location, pose = place.opening.location, facing(place, 0)
        pixels = CAMERA.view(pose).project(np.array([(location.x_m, location.y_m, location.height_m)]))
        u, v = (round(float(pixel)) for pixel in pixels[0])
        return renderer().render(pose, 0)[v - 60 : v + 60, u - 60 : u + 60]

    assert inside(empty).mean() < 60 < inside(full).mean()
    assert inside(empty).std() > 2.0


def test_flying_past_smears_the_codes() -> None:
    place = next(p for p in places().values() if p.labels and p.labels[0].condition is Condition.CLEAN)
    fast = FrontCamera(exposure_s=0.01)
    sharp = renderer().render(facing(place, 0), 0)
    smeared = FrontRenderer(SITE, fast, LOOK, SEED).render(facing(place, 0, vx_mps=2.0), 0)
    assert np.abs(np.diff(sharp.astype(int), axis=1)).mean() > 1.3 * (
        np.abs(np.diff(smeared.astype(int), axis=1)).mean()
    )
    right_px, down_px = fast.smear_px(facing(place, 0, vx_mps=2.0), 1.2)
    assert abs(right_px) == pytest.approx(0.02 / 1.2 * 1000.0, rel=0.05)
    assert abs(down_px) < 1.5


def test_what_is_out_of_focus_is_blurred() -> None:
    assert CAMERA.defocus_px(1.2) == pytest.approx(0.0)
    assert CAMERA.defocus_px(0.6) > CAMERA.defocus_px(0.9) > 0.1


@pytest.mark.parametrize(("height_m", "yaw_deg"), [(0.1, 0.0), (1.5, 45.0), (5.0, 180.0), (1.5, 90.0)])
def test_it_draws_from_anywhere(height_m: float, yaw_deg: float) -> None:
    place = next(iter(places().values()))
    for x_m in (-30.0, 0.0, 100.0):
        pose = facing(place, 0, x_m=x_m, height_m=height_m, yaw_rad=math.radians(yaw_deg), roll_rad=0.4)
        assert renderer().render(pose, 0).shape == (800, 1280, 3)


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="1280x800"):
        renderer().render(facing(next(iter(places().values()))), 0, np.empty((10, 10, 3), np.uint8))


def left_front() -> StockPlace:
    return next(p for p in places().values() if p.opening.location.side is Side.LEFT and p.labels)


def in_light(**light: float) -> FrontRenderer:
    named = {name.replace("_", " "): factor for name, factor in light.items()}
    return FrontRenderer(SITE, CAMERA, replace(STILL, light=named), SEED)


def test_light_falls_on_its_own_front_and_level() -> None:
    pose = facing(left_front(), 0, roll_rad=0.0, pitch_rad=0.0, height_m=1.35)
    usual = in_light().render(pose, 0).astype(float)
    dim = in_light(A_left_1=0.5).render(pose, 0).astype(float)
    assert dim[600:, 400:].mean() / usual[600:, 400:].mean() == pytest.approx(0.5, abs=0.02)
    assert np.abs(dim[:250] - usual[:250]).mean() < 1.0
    assert np.array_equal(in_light(A_right=0.5).render(pose, 0), usual.astype(np.uint8))


def test_what_is_over_lit_is_not_lost_for_a_shorter_exposure() -> None:
    pose = facing(left_front(), 0)
    usual, bright = in_light().render(pose, 0).astype(float), in_light(A_left=3.0)
    assert (bright.render(pose, 0) == 255).mean() > 0.05
    shorter = bright.render(pose, 0, None, Taking(1.0 / 3.0)).astype(float)
    assert np.abs(shorter - usual)[200:-200, 300:-300].mean() < 2.0


def test_gain_brings_light_and_noise() -> None:
    noisy = FrontRenderer(SITE, CAMERA, replace(STILL, noise=2.0), SEED)
    pose = facing(left_front(), 0)
    still = in_light().render(pose, 0).astype(float)
    usual, gained = noisy.render(pose, 0), noisy.render(pose, 0, None, Taking(0.25, 4.0))
    assert gained.mean() == pytest.approx(usual.mean(), rel=0.03)
    assert np.abs(gained - still).mean() > 1.5 * np.abs(usual - still).mean()


def test_a_lamp_lights_what_is_near() -> None:
    node = SITE.nodes[left_front().opening.location.node]
    near, far = (facing(left_front(), 0, y_m=node.y_m + off_m) for off_m in (-0.3, 0.3))
    dark = in_light(A_left=0.1)
    brighter = [
        dark.render(pose, 0, how=Taking(lamp=0.9)).mean() - dark.render(pose, 0).mean()
        for pose in (near, far)
    ]
    assert max(brighter) > 1.3 * min(brighter) > 10.0
