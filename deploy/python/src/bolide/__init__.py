"""Bolide from Python: decks built from shapes, runs here or on a cluster, results as pandas and pyvista, studies.

    import bolide as bo
    d = bo.Deck("mm-ms-kg", end_time=0.05)
    s = d.sphere("ball", "STEEL_4340", diameter=10, velocity=(0, 0, -800))
    p = d.plate("plate", "AL_2024_T351", size=(80, 80, 6), cell=1, erode=1.5)
    p.clamp("edges"); d.quarter("x", "y"); d.place(s, above=p)
    r = d.run(workers=3)
    print(r["ball"].residual_velocity, r.warnings)

All physics is in the `bolide` binary, which the wheel carries: this package writes decks, asks the binary, and reads what it wrote.
"""

from .binary import version
from .cluster import Cluster, Job
from .deck import Deck, Forecast, Part, PartForecast, check
from .errors import BinaryError, BolideError, ClusterError, DeckError, RunError, StudyError, UnknownName
from .history import History
from .library import material, materials
from .local import LocalCluster
from .results import GaugeResult, PartResult, Picture, Result
from .run import run
from .study import Limit, Study, study
from .toml import Expression

__all__ = [
    "BinaryError",
    "BolideError",
    "Cluster",
    "ClusterError",
    "Deck",
    "DeckError",
    "Expression",
    "Forecast",
    "GaugeResult",
    "History",
    "Job",
    "Limit",
    "LocalCluster",
    "Part",
    "PartForecast",
    "PartResult",
    "Picture",
    "Result",
    "RunError",
    "Study",
    "StudyError",
    "UnknownName",
    "check",
    "material",
    "materials",
    "run",
    "study",
    "version",
]
