"""Machine code of a kernel by LLVM: made once, kept in the user's cache, loaded from there ever after.

What is loaded is what was kept, also the first time: the first call has the same bits as all others.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
from llvmlite import binding

from eposit.compiled.cache import Cache
from eposit.compiled.expressions import LIBRARY
from eposit.compiled.kernel import NOTHING, NUMBER, POINTER, WHOLE, Kernel
from eposit.compiled.translate import module_text

SPEED = 2  # of LLVM's levels of optimisation
C_TYPES = {NUMBER: ctypes.c_double, WHOLE: ctypes.c_int64, POINTER: ctypes.c_void_p, NOTHING: None}


@cache
def native(kernel: Kernel) -> Callable[..., Any]:
    """The kernel as Python calls it: arrays are given by their addresses, and only one number or none is returned."""
    machine, processor = target_machine(), _processor()
    packages = {Path(__file__).parent, Path(kernel.function.__code__.co_filename).parent}
    kept = Cache(packages, (llvmlite.__version__, machine.triple, *processor))
    code = kept.read(kernel.name)
    if code is None:
        code = object_code(kernel)
        kept.write(kernel.name, code)
    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine)
    engine.add_object_file(binding.ObjectFileRef.from_data(code))
    engine.finalize_object()
    returns, *arguments = (C_TYPES[kind] for kind in (str(kernel.returns), *kernel.arguments))
    call: Any = ctypes.CFUNCTYPE(returns, *arguments)(engine.get_function_address(kernel.name))
    call.engine = engine  # the machine code lives as long as this
    return call


def object_code(kernel: Kernel) -> bytes:
    """Compiled by LLVM, in the format of the system's object files."""
    machine = target_machine()
    module = binding.parse_assembly(module_text(kernel))
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    options = binding.create_pipeline_tuning_options(speed_level=SPEED)
    options.loop_vectorization = options.slp_vectorization = False
    builder = binding.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return machine.emit_object(module)


def target_machine() -> binding.TargetMachine:
    """For this processor."""
    _prepare()
    name, features = _processor()
    target = binding.Target.from_default_triple()
    return target.create_target_machine(cpu=name, features=features, opt=SPEED, jit=True)


def _processor() -> tuple[str, str]:
    return binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()


@cache
def _prepare() -> None:
    """Once in a process: LLVM's part for this processor, and where the functions of the C library are."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    for name in LIBRARY:
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        binding.add_symbol(name, address)
