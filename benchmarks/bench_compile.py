"""How long does a fresh integrator take to compile, per format?

Run: python -m pytest benchmarks/bench_compile.py --benchmark-enable
"""

import heyoka
import pytest

from heavytop.integrate.heyoka import engines
from heavytop.precision import DOUBLE, EXTENDED, QUAD, real
from heavytop.top.equations import GYROSTAT, HEAVY_TOP


@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT], ids=lambda s: s.name)
@pytest.mark.parametrize("precision", [DOUBLE, EXTENDED, QUAD, real(237)], ids=lambda p: p.name)
def test_compile(benchmark, system, precision) -> None:
    def forget() -> None:
        engines.build.results.clear()
        heyoka.llvm_state.clear_memcache()

    tool = benchmark.pedantic(lambda: engines.compiled(system, precision), setup=forget, rounds=3)
    benchmark.extra_info["order"] = tool.flags["order"]
    benchmark.extra_info["compact_mode"] = tool.flags["compact_mode"]
