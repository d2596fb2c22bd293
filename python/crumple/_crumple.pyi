"""The compiled part; its functions give plain tuples and buffers."""

from pathlib import Path
from typing import final

__all__ = ["__version__", "Floats", "TrainedModel", "Forest", "read", "files", "database", "case", "main"]

__version__: str

# A buffer of float64, for numpy.frombuffer.
@final
class Floats: ...

type _History = tuple[str, str | None, str | None, Floats]
type _Section = tuple[str, str | None, str | None, list[str], list[str], Floats, list[_History]]
type _Case = tuple[str, tuple[float, str], tuple[float, float | None], str, list[Floats], list[str], list[str]]

def read(
    path: str, ids: list[str] | None, components: list[str] | None, section_name: str | None, format: str | None
) -> list[_Section]: ...
def files(folder: str) -> list[Path]: ...
def database(path: str) -> list[tuple[str, list[str]]]: ...
def case(path: str, group: str, name: str) -> _Case: ...
def main(arguments: list[str]) -> int: ...

@final
class TrainedModel:
    def __new__(cls, path: str) -> TrainedModel: ...
    def to_json(self) -> bytes: ...
    @staticmethod
    def of_json(path: str, json: bytes) -> TrainedModel: ...
    def facts(self) -> tuple[str, str, tuple[float, float]]: ...
    def predict(
        self,
        speed: float | str | None,
        crush: float | str | None,
        extrapolate: bool,
        mass: float | str | None,
        max_crush: str | None,
        parameters: list[tuple[str, float | str]],
        energy_correct: bool,
    ) -> str: ...

@final
class Forest:
    @staticmethod
    def fit(
        x: bytes,
        features: int,
        y: bytes,
        trees: int,
        seed: int,
        max_depth: int | None,
        min_samples_leaf: int,
        max_features: int | None,
        bootstrap: bool,
        random_thresholds: bool,
    ) -> Forest: ...
    def predict(self, x: bytes, features: int) -> Floats: ...
    def importance(self) -> Floats | None: ...
    def to_json(self) -> str: ...
    @staticmethod
    def of_json(json: str) -> Forest: ...
