"""What the sections of every file that people write have in common."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from flightd.core.geometry import Lens

Width: TypeAlias = Annotated[int, Field(ge=16, le=7680, description="picture width")]
Height: TypeAlias = Annotated[int, Field(ge=16, le=4320, description="picture height")]
FocalX: TypeAlias = Annotated[float, Field(gt=1, le=20000, description="focal length in x")]
FocalY: TypeAlias = Annotated[float, Field(gt=1, le=20000, description="focal length in y")]
_Bend = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
_Offset = Annotated[float, Field(ge=-2, le=2, allow_inf_nan=False)]


class Section(BaseModel):
    """Frozen once read; a key that it does not know is refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class OpticsSection(Section):
    """A camera's picture, lens and place on the drone; pixels, metres."""

    width_px: Width
    height_px: Height
    fx_px: FocalX
    fy_px: FocalY
    cx_px: float | None = Field(
        None, allow_inf_nan=False, description="principal point x; the picture's middle when left out"
    )
    cy_px: float | None = Field(
        None, allow_inf_nan=False, description="principal point y; the picture's middle when left out"
    )
    distortion: tuple[_Bend, _Bend, _Bend, _Bend, _Bend] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="k1 k2 p1 p2 k3, OpenCV's order"
    )
    mount_offset_m: tuple[_Offset, _Offset, _Offset] = Field(
        (0.0, 0.0, 0.0), description="camera from the range finder's origin: forward, right, down"
    )

    def lens(self) -> Lens:
        cx = (self.width_px - 1) / 2 if self.cx_px is None else self.cx_px
        cy = (self.height_px - 1) / 2 if self.cy_px is None else self.cy_px
        return Lens(self.width_px, self.height_px, self.fx_px, self.fy_px, cx, cy, self.distortion)
