"""The configuration of a training run: a TOML file, kept in every checkpoint."""

from __future__ import annotations

import dataclasses
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from training.model.config import ConfigError, ModelConfig, from_dict
from training.model.losses import LossConfig

CONFIGS = Path(__file__).resolve().parent / "configs"


@dataclass(frozen=True)
class DataConfig:
    """Batches: `batch` patches of `patch` pixels a step, with `spp_min` to `spp_max` samples.

    `exposure` is the largest change of brightness in stops. `vertex_dropout` is the probability
    that a patch's paths lose what they know from a random vertex (1 to 5) on, `feature_dropout`
    that they lose everything but radiance.
    """

    batch: int = 4
    patch: int = 96
    spp_min: int = 2
    spp_max: int = 8
    flips: bool = True
    permute_colours: bool = True
    exposure: float = 2.0
    vertex_dropout: float = 0.0
    feature_dropout: float = 0.0


@dataclass(frozen=True)
class OptimisationConfig:
    """AdamW: warm-up over `warmup` steps, then a cosine from `rate` to `final_rate`."""

    rate: float = 1e-4
    final_rate: float = 1e-4
    warmup: int = 0
    weight_decay: float = 0.0
    clip: float = 1000.0
    average: float = 0.999


@dataclass(frozen=True)
class Config:
    """A training run, apart from its data, seed and length."""

    model: ModelConfig = field(default_factory=ModelConfig)
    loss: LossConfig = field(default_factory=LossConfig)
    data: DataConfig = field(default_factory=DataConfig)
    optimisation: OptimisationConfig = field(default_factory=OptimisationConfig)

    def with_features(self, features: str | None) -> Config:
        """With another feature set, if one is named."""
        if not features:
            return self
        return dataclasses.replace(self, model=dataclasses.replace(self.model, features=features))

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_dict(values: dict[str, Any]) -> Config:
        """Raises ConfigError."""
        kinds: dict[str, Any] = {
            "model": ModelConfig,
            "loss": LossConfig,
            "data": DataConfig,
            "optimisation": OptimisationConfig,
        }
        for name in values:
            if name not in kinds:
                raise ConfigError(f"[{name}] is unknown; there are {', '.join(kinds)}")
        parts = {name: from_dict(kinds[name], part, name) for name, part in values.items()}
        return Config(**parts)

    @staticmethod
    def read(name: str, *overrides: str) -> Config:
        """A file, or one of training/configs by name; overrides are like ``model.width=16``."""
        file = Path(name) if name.endswith(".toml") else CONFIGS / f"{name}.toml"
        try:
            values = tomllib.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            known = ", ".join(sorted(path.stem for path in CONFIGS.glob("*.toml")))
            raise ConfigError(f"{file}: {error.strerror}; there are {known}") from error
        except tomllib.TOMLDecodeError as error:
            raise ConfigError(f"{file} is no TOML: {error}") from error
        for text in overrides:
            key, separator, value = text.partition("=")
            section, dot, option = key.strip().partition(".")
            if not separator or not dot:
                raise ConfigError(f"{text}: write SECTION.NAME=VALUE, as in model.width=16")
            try:
                parsed = tomllib.loads(f"v = {value}")["v"]
            except tomllib.TOMLDecodeError:
                parsed = value.strip()
            values.setdefault(section, {})[option] = parsed
        return Config.from_dict(values)
