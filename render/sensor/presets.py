"""The sensor as values, and four named sets of them: from an ideal camera to a poor one."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

DEFAULT_REGIME = "clean"


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorModel:
    """From linear light to 8 bits; the defaults are those of the regime `clean`.

    Raises:
        ValueError: a value out of range, or read noise without a full well.
    """

    exposure: Annotated[float, "grey value, as a share of full scale, of radiance 1: the white board at its centre"] = (
        0.8
    )
    psf_sigma_px: Annotated[float, "standard deviation of the gaussian point spread, px; 0 for none"] = 0.7
    defocus_radius_px: Annotated[float, "radius of the disc that a point out of focus becomes, px; 0 for none"] = 0.0
    exposure_s: Annotated[float, "exposure time, s, during which the board moves at its pose's rate; 0 for none"] = 0.0
    vignetting: Annotated[float, "share of light lost in the picture's corners, by the cos^4 law; 0 for none"] = 0.0
    natural_falloff: Annotated[
        float,
        "power of what the lens loses towards its rim by a flat pupil of fixed size: 1 for all (cos^4 of a perspective "
        "lens, none of an orthogonal one), less where the pupil grows with the angle, 0 for none",
    ] = 0.0
    uneven: Annotated[
        float, "gradient of light over the picture, share of the mean at the corners, direction by frame; 0 for none"
    ] = 0.0
    full_well_e: Annotated[float, "electrons at full scale, which decide the shot noise; 0 for no noise"] = 0.0
    read_noise_e: Annotated[float, "standard deviation of the read noise, electrons"] = 0.0
    gamma: Annotated[float, "grey = linear ** (1 / gamma); 1 is a linear camera, 2.2 a display-like one"] = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.exposure <= 100.0:
            raise ValueError(f"sensor exposure is {self.exposure}; it must be above 0 and at most 100")
        limits = {
            "psf_sigma_px": (0.0, 10.0, " px"),
            "defocus_radius_px": (0.0, 20.0, " px"),
            "exposure_s": (0.0, 1.0, " s"),
            "vignetting": (0.0, 0.95, ""),
            "natural_falloff": (0.0, 2.0, ""),
            "uneven": (0.0, 0.95, ""),
            "full_well_e": (0.0, 1e7, " electrons"),
            "read_noise_e": (0.0, 1e5, " electrons"),
            "gamma": (0.2, 5.0, ""),
        }
        for name, (low, high, unit) in limits.items():
            if not low <= getattr(self, name) <= high:
                given = getattr(self, name)
                raise ValueError(f"sensor {name} is {given}; it must lie in {low:g} to {high:.16g}{unit}")
        if self.read_noise_e > 0.0 and self.full_well_e == 0.0:
            raise ValueError(
                f"sensor read_noise_e is {self.read_noise_e} and full_well_e 0; give full_well_e, which says how many "
                "electrons make full scale, or set read_noise_e to 0"
            )

    @property
    def needs_frame(self) -> bool:
        """Whether a picture depends on the frame's seed, motion or camera and not on its light alone."""
        return any(value > 0.0 for value in (self.full_well_e, self.uneven, self.exposure_s, self.natural_falloff))


def regimes() -> dict[str, SensorModel]:
    """The named sets of values.

    clean: an ideal linear camera with the blur of a good lens.
    typical: a machine-vision camera with a global shutter and pixels of 3.45 um (Sony's second Pregius generation):
        EMVA 1288 sheets of several makers give about 10.5 ke- of saturation and 2.3 to 2.5 e- of temporal dark noise.
        Eight bits span the full well. A lens in good focus, 2 ms of exposure.
    paper: blur and noise with which OpenCV's corners (findChessboardCorners, cornerSubPix with a window of 5) of this
        board at 2 m, tilted up to 30 degrees, scatter by 0.40 px per axis (1.4826 times the median deviation), as the
        paper's did: defocus, and so little light that 235 electrons make full scale. Found by search; a test holds it.
    harsh: short of light, out of focus, moving, unevenly lit, dark corners; boards are still found.
    """
    return {
        "clean": SensorModel(),
        "typical": SensorModel(
            exposure=0.75,
            defocus_radius_px=0.6,
            exposure_s=0.002,
            vignetting=0.15,
            uneven=0.05,
            full_well_e=10500.0,
            read_noise_e=2.4,
        ),
        "paper": SensorModel(
            exposure=0.6, psf_sigma_px=1.0, defocus_radius_px=3.0, full_well_e=235.0, read_noise_e=8.0
        ),
        "harsh": SensorModel(
            exposure=0.6,
            psf_sigma_px=0.9,
            defocus_radius_px=2.0,
            exposure_s=0.015,
            vignetting=0.4,
            uneven=0.25,
            full_well_e=600.0,
            read_noise_e=8.0,
        ),
    }


def regime_of(model: SensorModel) -> str | None:
    """The regime that has exactly these values, None if there is none."""
    return next((name for name, other in regimes().items() if other == model), None)


def regime_rows() -> list[tuple[str, list[float]]]:
    """Every key of the sensor with its value in each regime, in the order of `regimes`."""
    models = regimes().values()
    return [(field.name, [getattr(model, field.name) for model in models]) for field in fields(SensorModel)]
