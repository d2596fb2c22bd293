from collections.abc import Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import xarray as xr
from numpy.typing import NDArray

from crumple._commands import Warned as Warned
from crumple._commands import add as add
from crumple._commands import build as build
from crumple._commands import init as init
from crumple._commands import rate as rate
from crumple._commands import run as run
from crumple._commands import sweep as sweep
from crumple._commands import train as train
from crumple._commands import validate as validate
from crumple._errors import Error as Error

type _Path = str | PathLike[str]
type _Id = int | str | None
type _Array = NDArray[np.float64]

__version__: str
__all__ = [
    "Case", "Component", "Curve", "Database", "Error", "Group", "Histories", "Model", "Run", "Section", "Warned",
    "add", "build", "init", "rate", "read", "run", "simulate", "sweep", "train", "validate",
]

class _Mapping[K, V](Mapping[K, V]):
    def __init__(self, items: dict[K, V]) -> None: ...
    def __getitem__(self, name: K) -> V: ...
    def __iter__(self) -> Iterator[K]: ...
    def __len__(self) -> int: ...

class Component(_Mapping[_Id, _Array]):
    name: str
    time: _Array
    def __init__(self, name: str, time: _Array, values: dict[_Id, object], titles: dict[_Id, str | None]) -> None: ...
    @property
    def ids(self) -> list[_Id]: ...
    @property
    def titles(self) -> list[str | None]: ...
    @property
    def array(self) -> _Array: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]: ...
    def __contains__(self, entity: object) -> bool: ...
    def __getitem__(self, entity: _Id) -> _Array: ...

class Section(_Mapping[str, Component]):
    name: str
    title: str | None
    solver: str | None
    problems: list[str]
    notes: list[str]
    time: _Array
    def __init__(
        self,
        name: str,
        title: str | None,
        solver: str | None,
        problems: list[str],
        notes: list[str],
        time: Any,
        histories: Iterable[tuple[str, str | None, str | None, Any]],
    ) -> None: ...
    def to_pandas(self) -> pd.DataFrame: ...
    def to_polars(self) -> pl.DataFrame: ...
    def to_xarray(self) -> xr.Dataset: ...

class Histories(_Mapping[str, Section]):
    path: Path
    def __init__(self, path: Path, sections: Iterable[Section]) -> None: ...
    @property
    def problems(self) -> list[str]: ...
    def only(self) -> Section: ...
    def to_pandas(self) -> pd.DataFrame: ...
    def to_polars(self) -> pl.DataFrame: ...
    def to_xarray(self) -> xr.Dataset: ...

def read(
    path: _Path,
    ids: int | str | Iterable[int | str] | None = None,
    components: str | Iterable[str] | None = None,
    section: str | None = None,
    format: str | None = None,
) -> Histories: ...

class Case:
    name: str
    speed: float
    speed_kind: str
    mass: float
    other_mass: float | None
    force_kind: str
    time: _Array
    deflection: _Array
    force: _Array
    body_force: _Array
    closing_speed: _Array
    tags: tuple[str, ...]
    warnings: tuple[str, ...]
    def __init__(
        self,
        name: str,
        speed: tuple[float, str],
        masses: tuple[float, float | None],
        force_kind: str,
        curves: Iterable[Any],
        tags: list[str],
        warnings: list[str],
    ) -> None: ...
    def to_pandas(self) -> pd.DataFrame: ...

class Group(_Mapping[str, Case]):
    path: Path
    name: str
    def __init__(self, path: Path, name: str, cases: Iterable[str], state: tuple[int, int] | None) -> None: ...
    def __contains__(self, name: object) -> bool: ...
    def __getitem__(self, name: str) -> Case: ...
    def to_pandas(self) -> pd.DataFrame: ...

class Database(_Mapping[str, Group]):
    path: Path
    def __init__(self, path: _Path) -> None: ...
    def validate(self, group: str | None = None, **options: object) -> Any: ...
    def train(self, output: _Path, group: str | None = None, **options: object) -> Model: ...

class Model:
    path: Path
    group: str
    name: str
    range: tuple[float, float]
    def __init__(self, path: _Path) -> None: ...
    def predict(
        self,
        speed: float | str | None = None,
        extrapolate: bool = False,
        *,
        crush: float | str | None = None,
        mass: float | str | None = None,
        max_crush: str | None = None,
        parameters: Mapping[str, float | str] | None = None,
        energy_correct: bool = False,
    ) -> Curve: ...
    def __getstate__(self) -> dict[str, Any]: ...
    def __setstate__(self, state: dict[str, Any]) -> None: ...

class Curve:
    document: dict[str, Any]
    speed: float
    max_deflection: float
    deflection: _Array
    force: _Array
    body_force: _Array | None
    force_kind: str
    band: tuple[_Array, _Array] | None
    body_band: tuple[_Array, _Array] | None
    band_level: float | None
    warnings: list[Any]
    def __init__(self, document: dict[str, Any]) -> None: ...
    def to_pandas(self) -> pd.DataFrame: ...
    def export(self, output: _Path, to: str | None = None, **options: object) -> Any: ...

class Run(_Mapping[str, _Array]):
    summary: dict[str, Any]
    ledger: dict[str, Any]
    warnings: list[str]
    def __init__(self, document: dict[str, Any]) -> None: ...
    def to_pandas(self) -> pd.DataFrame: ...

def simulate(scenario: _Path) -> Run: ...
