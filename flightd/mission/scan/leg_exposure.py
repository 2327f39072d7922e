"""How the front camera is to expose while it flies past shelves, learnt front by front on the way."""

from __future__ import annotations

from collections.abc import Iterable

from flightd.config.scan import ScanConfig
from flightd.core.scanning import CodeSet
from flightd.core.types import Event, EventLevel
from flightd.mission.plan.sweep_leg import SweepLeg
from flightd.mission.scan.face_light import USUAL, Face, FaceLight, LegLight
from flightd.site.site import Site


class LegExposure:
    """The exposure of the leg in hand, by what was learnt of the light on its rack fronts."""

    def __init__(self, site: Site, params: ScanConfig) -> None:
        self._site = site
        self._light = FaceLight(params.expert.darker, params.expert.brighter, params.sweep.most_gain)
        self._shot = USUAL
        self.fixed = False
        """The camera was told to be exposed as it is."""

    @property
    def taken_with(self) -> tuple[float, float]:
        """What pictures are wanted with, as parts of the camera's usual exposure and gain."""
        return self._shot.exposure, self._shot.gain

    @property
    def most_mps(self) -> float:
        """No faster may be flown for want of light."""
        return self._shot.speed_mps

    @property
    def follows(self) -> bool:
        """Whether the camera has not shown that it is exposed as it is."""
        return self._light.follows

    def fix(self, now_ns: int) -> list[Event]:
        """The camera has shown that it is exposed as it is; what is to be said of that, once."""
        if self.fixed:
            return []
        self.fixed = True
        self._light.fix()
        text = "the front camera does not support exposure control: what is lit wrongly stays unreadable"
        return [Event(now_ns, EventLevel.WARNING, "exposure_fixed", text)]

    def of_places(self, codes: Iterable[str]) -> float:
        """The exposure that was right when the fronts of these places were flown past."""
        return self._light.part({self._face(code) for code in codes})

    def aim(self, leg: SweepLeg, sharp_mps: float, flown_mps: float) -> None:
        """Choose how `leg` is to be taken at the speed `flown_mps`; `sharp_mps` is how fast what is taken
        with the usual exposure may be flown past."""
        light = LegLight(leg.speed_mps, leg.exposure, sharp_mps)
        self._shot = self._light.shot(_faces(leg), light, flown_mps)

    def take(self, leg: SweepLeg, codes: CodeSet) -> None:
        """Learn from a picture that was taken on `leg`."""
        self._light.take(self._whites(leg, codes), self._shot, (codes.exposure, codes.gain), leg.exposure)

    def drain_events(self, now_ns: int) -> list[Event]:
        """The fronts whose light turned out to be another than the usual."""
        return [
            Event(
                now_ns,
                EventLevel.INFO,
                "face_light",
                f"aisle {aisle} {side}, level {level}: taken with {part:.2f} times the usual light",
            )
            for (aisle, side, level), part in self._light.drain_changed()
        ]

    def _whites(self, leg: SweepLeg, codes: CodeSet) -> dict[Face, float | None]:
        """What white paper came out as, by front: by the labels there, else by the whole picture."""
        whites: dict[Face, float | None] = dict.fromkeys(_faces(leg), codes.white)
        for place in codes.places:
            if place.white is not None and (face := self._face(place.location)) in whites:
                whites[face] = place.white
        return whites

    def _face(self, code: str) -> Face:
        place = self._site.locations[code]
        return place.aisle, place.side, place.level


def _faces(leg: SweepLeg) -> list[Face]:
    return [(leg.aisle, leg.side, level) for level in leg.levels]
