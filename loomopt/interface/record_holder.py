"""An object to work with that holds a plain record: the record's attributes are its own too."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Record = TypeVar("Record", covariant=True)


@dataclass(frozen=True, repr=False)
class RecordHolder(Generic[Record]):
    """Holder of a record that a computation returned."""

    result: Record

    def __getattr__(self, name: str) -> Any:
        """Attribute of the record."""
        if name == "result" or name.startswith("__"):  # while it is being unpickled there is no record yet
            raise AttributeError(name)
        return getattr(self.result, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(name for name in dir(self.result) if not name.startswith("_"))})
