"""Tensors of crops; where torch is not installed, with the stand-in of these tests."""

import io
import pickle
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import torch.utils.data
from conftest import HAS_TORCH, draw
from numpy.lib.stride_tricks import as_strided

import image_gip
from image_gip.torch import (
    CenterCrop,
    Columns,
    Crop,
    Extension,
    RandomResizedCrop,
    Resize,
    Transform,
    decode_batch,
)


class Part(Transform):
    """A part that does not depend on chance."""

    def crop(self, stored: tuple[int, int], draws: Any) -> Crop:
        return Crop(8, 16, 32, 48, True)


@pytest.fixture(scope="module")
def files() -> list[bytes]:
    return [image_gip.encode(draw(96 + 8 * i, 64, 3), bpp=2, effort=1) for i in range(4)]


def expected(file: bytes) -> Any:
    return image_gip.decode(file)[8:40, 16:64][:, ::-1].transpose(2, 0, 1)


def test_a_transform_decodes_what_it_shows(file: bytes) -> None:
    tensor = Part((32, 48))(file)
    assert tensor.dtype == torch.uint8
    assert np.array_equal(tensor, expected(file))
    floats = Part((32, 48), dtype=torch.float32)(file)
    assert floats.dtype == torch.float32
    assert np.abs(floats.numpy() * 255 - expected(file)).max() <= 0.501


def test_sources(file: bytes, tmp_path: Path) -> None:
    path = tmp_path / "photo.gip"
    path.write_bytes(file)
    transform = Part((32, 48))
    for source in (path, str(path), io.BytesIO(file), memoryview(file), bytearray(file)):
        assert np.array_equal(transform(source), expected(file))
    path.write_bytes(file[:40])
    with pytest.raises(image_gip.UnexpectedEndError) as error:
        transform(path)
    assert error.value.__notes__ == [f"in {str(path)!r}"]


@pytest.mark.parametrize("dtype", [torch.uint8, torch.float32])
@pytest.mark.parametrize("layout", [torch.contiguous_format, torch.channels_last])
def test_batches_into_a_given_tensor(file: bytes, dtype: Any, layout: Any) -> None:
    out = torch.empty((3, 3, 32, 48), dtype=dtype, memory_format=layout)
    transform = Part((32, 48))
    batch = decode_batch([file] * 3, transform, out=out, threads=2)
    assert batch.images is out
    assert batch.errors == {}
    one = Part((32, 48), dtype=dtype)(file)
    assert all(torch.equal(image, one) for image in out)


def test_what_does_not_fit_is_refused(file: bytes) -> None:
    transform = Part((32, 48))
    with pytest.raises(ValueError, match=r"out has shape \(3, 32, 47\)"):
        transform(file, out=torch.empty((3, 32, 47), dtype=torch.uint8))
    with pytest.raises(ValueError, match="that of 2 pictures"):
        decode_batch([file] * 2, transform, out=torch.empty((3, 3, 32, 48), dtype=torch.uint8))
    samples = np.zeros(2 * 3 * 32 * 48, np.uint8)
    for step in (0, 1, 32 * 48):  # that of a tensor that is expanded, and others
        shared = as_strided(samples, (2, 3, 32, 48), (step, 32 * 48, 48, 1))
        tensor = torch.from_numpy(shared) if HAS_TORCH else shared.view(torch.Tensor)
        with pytest.raises(ValueError, match="share memory"):
            decode_batch([file] * 2, transform, out=tensor)
    # One picture, none of whose channels has a place of its own.
    shared = as_strided(samples, (3, 32, 48), (0, 48, 1))
    tensor = torch.from_numpy(shared) if HAS_TORCH else shared.view(torch.Tensor)
    with pytest.raises(ValueError, match="contiguous"):
        transform(file, out=tensor)
    with pytest.raises(ValueError, match="differ in size"):
        decode_batch([file], Resize(32))
    for wrong in ({"dtype": torch.int32}, {"mode": "CMYK"}):
        with pytest.raises(ValueError, match="it must be"):
            Part(32, **wrong)
    with pytest.raises(ValueError, match="at least 224"):
        CenterCrop(224, 200)
    with pytest.raises(ValueError, match="flip is 2"):
        RandomResizedCrop(224, flip=2)


@pytest.mark.skipif(not HAS_TORCH, reason="there is no torch")
def test_tensors_are_on_the_cpu(file: bytes) -> None:
    transform = RandomResizedCrop(20)
    torch.set_default_device("meta")
    try:
        assert transform(file).device.type == "cpu"
        assert decode_batch([file], transform).images.device.type == "cpu"
    finally:
        torch.set_default_device("cpu")


def test_alpha_over_a_background() -> None:
    samples = np.dstack((draw(48, 32, 3), draw(48, 32, 1)))
    file = image_gip.encode(samples, bpp=4, effort=1)
    blue = Resize((32, 48), background=(0, 0, 255))(file)
    whole = image_gip.decode(file, background=(0, 0, 255), planar=True)
    assert np.array_equal(blue, whole)
    assert Resize((32, 48), mode="RGBA")(file).shape == (4, 32, 48)


def test_errors_of_each_picture(files: list[bytes]) -> None:
    bad = [files[0], files[1][:50], files[2], "missing.gip"]
    batch = decode_batch(bad, Part((32, 48)), errors="return", threads=2)
    assert {index: type(error) for index, error in batch.errors.items()} == {
        1: image_gip.UnexpectedEndError,
        3: FileNotFoundError,
    }
    assert np.array_equal(batch.images[2], expected(files[2]))
    assert not batch.images[1].any()
    with pytest.raises(image_gip.UnexpectedEndError) as error:
        decode_batch(bad, Part((32, 48)))
    assert error.value.__notes__ == ["picture 1 of 4"]
    # What is no fault of a file.
    for wrong, kind in ((None, TypeError), (3, TypeError), ("\0", ValueError)):
        with pytest.raises(kind) as other:
            decode_batch([files[0], wrong], Part((32, 48)), errors="return")
        assert other.value.__notes__ == ["picture 1 of 2"]
    file = files[0]
    one: list[Any] = ["a.gip", Path("a.gip"), file, bytearray(file), io.BytesIO(file)]
    for sources in [*one, np.frombuffer(file, np.uint8)]:
        with pytest.raises(TypeError, match="must be several"):
            decode_batch(sources, Part((32, 48)), errors="return")
    paths = np.array(["missing.gip"])
    assert list(decode_batch(paths, Part((32, 48)), errors="return").errors) == [0]


def test_sizes_are_whole_numbers_of_any_type(files: list[bytes]) -> None:
    sizes: list[Any] = [np.int64(24), (np.int32(24), 24), [24, 24]]
    for size in sizes:
        assert torch.equal(CenterCrop(size)(files[0]), CenterCrop(24)(files[0]))
    assert torch.equal(Resize(np.int64(24))(files[0]), Resize(24)(files[0]))
    wrong: list[Any] = [0, (24, 24, 24), 24.5, (24.5, 3)]
    for size in wrong:
        with pytest.raises((TypeError, ValueError)):
            CenterCrop(size)


def test_random_crops_follow_the_seed(files: list[bytes]) -> None:
    transform = RandomResizedCrop(24, flip=0.5)
    batches = []
    for threads in (1, 3):
        torch.manual_seed(5)
        batches.append(decode_batch(files, transform, threads=threads).images)
    torch.manual_seed(5)
    assert torch.equal(batches[0], batches[1])
    assert torch.equal(batches[0], torch.stack([transform(file) for file in files]))
    assert not torch.equal(transform(files[0]), transform(files[0]))
    own = [RandomResizedCrop(24, generator=torch.Generator().manual_seed(1)) for _ in range(2)]
    assert torch.equal(own[0](files[0]), own[1](files[0]))


def test_the_middle_and_the_whole(file: bytes) -> None:
    assert np.array_equal(
        CenterCrop((32, 48), 64)(file),
        image_gip.decode(file, region=(24, 16, 48, 32), planar=True),
    )
    assert CenterCrop(20)(file).shape == (3, 20, 20)
    assert np.array_equal(Resize(32)(file), image_gip.decode(file, size=(48, 32), planar=True))


class Files(torch.utils.data.Dataset):  # type: ignore[misc]
    def __init__(self, files: list[bytes], transform: Transform) -> None:
        self.files, self.transform = files, transform

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, index: int) -> Any:
        return self.transform(self.files[index]), index


@pytest.mark.skipif(not HAS_TORCH, reason="there is no torch")
@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_workers(files: list[bytes], start: str) -> None:
    loader = torch.utils.data.DataLoader(
        Files(files, Part((32, 48))), batch_size=2, num_workers=2, multiprocessing_context=start
    )
    seen = [
        (image, index) for images, at in loader for image, index in zip(images, at, strict=True)
    ]
    assert [int(index) for _, index in seen] == [0, 1, 2, 3]
    assert all(np.array_equal(image, expected(files[index])) for image, index in seen)


def test_transforms_are_pickled(file: bytes) -> None:
    for transform in (CenterCrop(20), Resize(20), RandomResizedCrop(20), Extension(Resize(8))):
        assert type(pickle.loads(pickle.dumps(transform))) is type(transform)


@pytest.mark.skipif(not HAS_TORCH, reason="there is no torch")
# It leaves files open.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_webdataset(files: list[bytes], tmp_path: Path) -> None:
    webdataset = pytest.importorskip("webdataset")
    shard = tmp_path / "shard.tar"
    with tarfile.open(shard, "w") as tar:
        for index, file in enumerate(files):
            for name, data in ((f"{index}.gip", file), (f"{index}.cls", b"%d" % index)):
                member = tarfile.TarInfo(name)
                member.size = len(data)
                tar.addfile(member, io.BytesIO(data))
    dataset = webdataset.WebDataset(str(shard), shardshuffle=False)
    samples = list(dataset.decode(Extension(Part((32, 48)))).to_tuple("gip", "cls"))
    assert [label for _, label in samples] == [0, 1, 2, 3]
    assert all(np.array_equal(image, expected(files[label])) for image, label in samples)


def test_other_extensions_are_left_alone(file: bytes) -> None:
    handler = Extension(Part((32, 48)))
    assert handler(".png", file) is None
    image = handler(".left.GIP", file)
    assert image is not None
    assert np.array_equal(image, expected(file))


@pytest.mark.skipif(not HAS_TORCH, reason="there is no torch")
def test_hugging_face(files: list[bytes]) -> None:
    datasets = pytest.importorskip("datasets")
    image_gip.register()
    rows = {"image": [{"bytes": file, "path": None} for file in files], "label": [0, 1, 2, 3]}
    dataset = datasets.Dataset.from_dict(rows).cast_column("image", datasets.Image())
    # By the feature, as Pillow opens it.
    assert np.array_equal(np.asarray(dataset[1]["image"]), image_gip.decode(files[1]))
    raw = dataset.cast_column("image", datasets.Image(decode=False))
    raw.set_transform(Columns({"image": Part((32, 48))}))
    assert raw[2]["label"] == 2
    assert np.array_equal(raw[2]["image"], expected(files[2]))


def test_columns_of_bytes_and_of_paths(file: bytes, tmp_path: Path) -> None:
    path = tmp_path / "photo.gip"
    path.write_bytes(file)
    for value in (file, str(path), {"bytes": None, "path": str(path)}):
        rows = Columns({"image": Part((32, 48))})({"image": [value], "label": [1]})
        assert np.array_equal(rows["image"][0], expected(file))
        assert rows["label"] == [1]
