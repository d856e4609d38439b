"""The entropy coder (section 7.3)."""

from pathlib import Path

from .errors import Malformed

MODELS_FILE = Path(__file__).resolve().parent.parent / "entropy-models.tsv"
SLOTS = 2**15
SYMBOLS = 16
LEAST_STATE = 2**16
EXCESS_CONTEXT = 156


def read_models():
    """The models with which each layer begins: for each context its sixteen starts, and start(16)."""
    models = []
    for line in MODELS_FILE.read_text().splitlines():
        number, *starts = (int(field) for field in line.split("\t"))
        assert number == len(models) and len(starts) == SYMBOLS
        models.append(starts + [SLOTS])
    return models


INITIAL_MODELS = read_models()


class EntropyReader:
    """Reads symbols, plain bits and numbers from the bytes of a layer."""

    def __init__(self, stream):
        self.stream = stream
        self.models = [list(starts) for starts in INITIAL_MODELS]
        self.reads = [0] * len(self.models)  # symbols that each model has read in this layer
        self.at = 4
        if len(stream) < 4:
            raise Malformed("a layer that is too short for the state")
        self.state = int.from_bytes(stream[:4], "little")
        if self.state < LEAST_STATE:
            raise Malformed("an initial state below 2^16")

    def renormalize(self):
        """Takes the next word if the state is below 2^16."""
        if self.state < LEAST_STATE:
            word = self.stream[self.at : self.at + 2]
            if len(word) < 2:
                raise Malformed("a layer that is too short")
            self.at += 2
            self.state = self.state * 2**16 + int.from_bytes(word, "little")

    def symbol(self, context):
        """Reads a symbol, 0 to 15, and adapts its model."""
        start = self.models[context]
        slot = self.state % SLOTS
        symbol = 0
        while start[symbol + 1] <= slot:
            symbol += 1
        self.state = (start[symbol + 1] - start[symbol]) * (self.state // SLOTS) + slot - start[symbol]
        self.renormalize()
        reads = self.reads[context]
        rate = 5 if reads < 32 else 6 if reads < 32 + 64 else 7
        self.reads[context] = reads + 1
        for s in range(1, SYMBOLS):
            target = s + (SLOTS - SYMBOLS if s > symbol else 0)
            start[s] += (target - start[s]) >> rate  # >> rounds down
        return symbol

    def plain(self, count):
        """Reads `count` plain bits, any number of them."""
        if count > 16:
            low = self.plain(16)
            return low + (self.plain(count - 16) << 16)
        value = self.state % 2**count
        self.state //= 2**count
        self.renormalize()
        return value

    def excess(self):
        n = self.symbol(EXCESS_CONTEXT)
        return 2**n + self.plain(n) - 1

    def signed(self, context, shift):
        """A signed number in a context with a shift."""
        s = self.symbol(context)
        if s < 15:
            h = s - 7
        else:
            negative = self.plain(1)
            h = 8 + self.excess()
            if negative:
                h = -h
        return h * 2**shift + self.plain(shift)

    def finish(self):
        """Checks what is left after the last Gaussian."""
        if self.state != LEAST_STATE:
            raise Malformed("a final state other than 2^16")
        if self.at != len(self.stream):
            raise Malformed("bytes behind the last Gaussian")
