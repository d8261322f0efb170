"""Names of Dr.Jit's and Mitsuba's types, for annotations only: importing this loads neither library.

Dr.Jit has a class for each back end, and the back end is chosen when a process first renders. `drjit.auto` stands for
whichever it is. An array holds one number for each pixel, cell or ray in flight, or a single one that serves them all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import drjit.auto.ad
    import mitsuba

    DeviceFloat: TypeAlias = drjit.auto.ad.Float
    DeviceInt: TypeAlias = drjit.auto.ad.Int
    DeviceIndex: TypeAlias = drjit.auto.ad.UInt
    DeviceBool: TypeAlias = drjit.auto.ad.Bool
    DevicePoint2: TypeAlias = mitsuba.Point2f
    DevicePoint3: TypeAlias = mitsuba.Point3f
    DeviceMatrix3: TypeAlias = mitsuba.Matrix3f
    DeviceVector3: TypeAlias = mitsuba.Vector3f
    DeviceRay: TypeAlias = mitsuba.Ray3f
    DeviceRayDifferential: TypeAlias = mitsuba.RayDifferential3f
    DeviceSpectrum: TypeAlias = mitsuba.Spectrum
    DeviceBox: TypeAlias = mitsuba.ScalarBoundingBox3f
    DeviceScene: TypeAlias = mitsuba.Scene
else:
    # Any: Dr.Jit resolves the annotations of dataclasses that Mitsuba hands to it, so every name needs a value.
    DeviceFloat = DeviceInt = DeviceIndex = DeviceBool = DevicePoint2 = DevicePoint3 = DeviceVector3 = Any
    DeviceMatrix3 = DeviceRay = DeviceRayDifferential = DeviceSpectrum = DeviceBox = DeviceScene = Any
