"""As much of `torch.utils.data` as the recipes need."""

from collections.abc import Callable, Iterator
from typing import Any


class Dataset:
    pass


class DataLoader:
    def __init__(
        self,
        dataset: Any,
        batch_size: int,
        *,
        num_workers: int = 0,
        shuffle: bool = False,
        collate_fn: Callable[[list[Any]], Any] = list,
    ) -> None:
        self.dataset, self.batch_size, self.collate = dataset, batch_size, collate_fn

    def __iter__(self) -> Iterator[Any]:
        samples = [self.dataset[index] for index in range(len(self.dataset))]
        for start in range(0, len(samples), self.batch_size):
            yield self.collate(samples[start : start + self.batch_size])
