"""Sections 2 to 9 of docs/format.md: fields, checksums, chunks, index and footer."""

import struct

import numpy as np


class Refused(Exception):
    """What the text calls refusing a file."""


class Unread(Exception):
    """What this decoder leaves out of the text."""


def require(holds, sentence):
    if not holds:
        raise Refused(sentence)


M64 = 2**64 - 1
# XXH3's published secret: 192 bytes that any implementation has.
SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671fcb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c"
    "3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364ea"
    "c5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
P32 = (0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D)
P64 = (0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5)
SHORT = (33, P64[1]), (29, P64[2]), (32, 1)
LONG = (37, 0x165667919E3779F9), (32, 1)


def _word(x, at, size=8):
    return int.from_bytes(x[at : at + size], "little")


def _key(at):
    return _word(SECRET, at) ^ _word(SECRET, at + 8)


def _fold(a, b):
    return a * b & M64 ^ a * b >> 64


def _avalanche(h, steps):
    h &= M64
    for shift, factor in steps:
        h = (h ^ h >> shift) * factor & M64
    return h


def _mix16(x, at, secret):
    return _fold(_word(x, at) ^ _word(SECRET, secret), _word(x, at + 8) ^ _word(SECRET, secret + 8))


def _long_hash(x):
    """Stripes of 64 bytes are added to eight sums, 16 to a block, which then are scrambled."""
    n = len(x)
    words = np.frombuffer(x, "<u8", n // 64 * 8).reshape(-1, 8)
    sums = np.array([P32[2], *P64[:4], P32[1], P64[4], P32[0]], np.uint64)
    keys = np.array([[_word(SECRET, 8 * (i + lane)) for lane in range(8)] for i in range(16)], np.uint64)

    def accumulate(stripes, secrets):
        keyed = stripes ^ secrets
        return sums + ((keyed & np.uint64(2**32 - 1)) * (keyed >> np.uint64(32)) + stripes[:, np.arange(8) ^ 1]).sum(0, np.uint64)

    blocks, stripes = (n - 1) // 1024, (n - 1) // 64
    for block in range(blocks):
        sums = accumulate(words[16 * block : 16 * block + 16], keys)
        sums = (sums ^ sums >> np.uint64(47) ^ np.frombuffer(SECRET, "<u8", 8, 128)) * np.uint64(P32[0])
    sums = accumulate(words[16 * blocks : stripes], keys[: stripes - 16 * blocks])
    sums = accumulate(np.frombuffer(x[-64:], "<u8").reshape(1, 8), np.frombuffer(SECRET, "<u8", 8, 121))
    folds = (_fold(int(sums[i]) ^ _word(SECRET, 11 + 8 * i), int(sums[i + 1]) ^ _word(SECRET, 19 + 8 * i)) for i in range(0, 8, 2))
    return _avalanche(n * P64[0] + sum(folds), LONG)


def hash64(x):
    """Section 2: XXH3 with 64 bits and seed 0."""
    n = len(x)
    if n == 0:
        return _avalanche(_key(56), SHORT)
    if n <= 3:
        return _avalanche((x[0] << 16 | x[n >> 1] << 24 | x[-1] | n << 8) ^ _word(SECRET, 0, 4) ^ _word(SECRET, 4, 4), SHORT)
    if n <= 8:
        h = _word(x, n - 4, 4) + (_word(x, 0, 4) << 32) ^ _key(8)
        h ^= ((h << 49 | h >> 15) ^ (h << 24 | h >> 40)) & M64
        h = h * 0x9FB21C651E98DF25 & M64
        h = (h ^ (h >> 35) + n) * 0x9FB21C651E98DF25 & M64
        return h ^ h >> 28
    if n <= 16:
        low, high = _key(24) ^ _word(x, 0), _key(40) ^ _word(x, n - 8)
        return _avalanche(n + int.from_bytes(low.to_bytes(8, "big"), "little") + high + _fold(low, high), LONG)
    if n > 240:
        return _long_hash(x)
    h = n * P64[0]
    if n <= 128:
        return _avalanche(h + sum(_mix16(x, 16 * i, 32 * i) + _mix16(x, n - 16 * i - 16, 32 * i + 16) for i in range((n + 31) // 32)), LONG)
    h = _avalanche(h + sum(_mix16(x, 16 * i, 16 * i) for i in range(8)), LONG)
    h += sum(_mix16(x, 16 * i, 16 * i - 125) for i in range(8, n // 16))
    return _avalanche(h + _mix16(x, n - 16, 119), LONG)


def unzigzag(u):
    return u >> 1 if u % 2 == 0 else -(u + 1 >> 1)


class Fields:
    """Section 2: fields one after the other."""

    def __init__(self, data, at=0):
        self.data, self.at = bytes(data), at

    def take(self, n):
        require(0 <= n <= len(self.data) - self.at, "a field ends early")
        self.at += n
        return self.data[self.at - n : self.at]

    def number(self, kind):
        return struct.unpack("<" + kind, self.take(struct.calcsize("<" + kind)))[0]

    def u8(self):
        return self.take(1)[0]

    def f64(self):
        return self.number("d")

    def count(self, most=M64):
        value = shift = 0
        while True:
            byte = self.u8()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                require((byte or shift == 7) and value <= most, "a count is too large, or not in its shortest spelling")
                return value

    def zigzag(self):
        return unzigzag(self.count())

    def section(self):
        return self.take(self.count())

    def text(self):
        return self.section().decode("utf-8", "surrogateescape")

    def list(self, item):
        return [item() for _ in range(self.count(len(self.data)))]

    def rest(self):
        return self.take(len(self.data) - self.at)

    def end(self):
        require(self.at == len(self.data), "bytes behind the last field")


KNOWN = set("INDX DESC TOPO POSI TWIN ARRY JOIN ORDR CELL TAIL STEP SVAL PIEC GIDS PIDX SIDX CTAB CDIR CIDX CHRT".split())


PACKED = "DESC TOPO POSI TWIN ARRY ORDR".split()


class Chunk:
    """Section 4."""

    def __init__(self, data, at):
        fields = Fields(data, at)
        require(fields.take(2) == b"\xa5\x4d", "no chunk stands here")
        self.type = fields.take(4).decode("latin-1")
        self.patch, self.number, self.part = (fields.count(2**32 - 1) for _ in range(3))
        size = fields.count(1 << 20)
        self.header = data[at : fields.at]
        require(fields.number("H") == hash64(self.header) & 0xFFFF, "a chunk's header is damaged")
        self.header = data[at : fields.at]
        self.content = fields.take(size)
        content_hash = hash64(data[at : fields.at])
        self.checksum, self.end = fields.number("Q"), fields.at
        require(self.checksum == content_hash, "a chunk's content is damaged")
        require(self.type in KNOWN or self.type[0].islower(), "a critical chunk of an unknown type")
        self.entry = self.type.encode("latin-1"), self.patch, self.number, self.part, size, self.checksum


class Container:
    """Sections 3 to 7: the streams of a file, by type, patch and number."""

    def __init__(self, data):
        header = Fields(data)
        require(header.take(8) == b"\x89MAI\x0d\x0a\x1a\x0a", "no maille file")
        version, self.required, _, self.mode = header.number("I"), header.number("I"), header.number("I"), header.u8()
        require(header.number("I") == hash64(data[:21]) & 0xFFFFFFFF, "the header is damaged")
        require(version == 2 << 16 and self.required < 4 and self.mode < 3, "a version, feature or mode that is not known")
        if self.required & 2:
            require(self.mode == 0, "another mode than single is packed")
            self.streams = self.packed(data)
            return
        parts = {}
        for chunk in self.chunks(data):
            require(parts.setdefault((chunk.type, chunk.patch, chunk.number), {}).setdefault(chunk.part >> 1, chunk) is chunk, "a stream has a part twice")
        self.streams = {}
        for key, by_part in parts.items():
            ordered = [by_part.get(i) for i in range(len(by_part))]
            require([c and c.part & 1 for c in ordered] == [0] * (len(ordered) - 1) + [1], "a stream lacks a part")
            self.streams[key] = b"".join(chunk.content for chunk in ordered)

    @staticmethod
    def packed(data):
        require(33 <= len(data) <= 65536 and data[-8:] == hash64(data[:-8]).to_bytes(8, "little"), "a packed file is damaged")
        streams, at = {}, 25
        while at < len(data) - 8:
            fields = Fields(data[:-8], at)
            stream, size = fields.count(2**32 - 1), fields.count(65536)
            entry, check, content = data[at : fields.at], fields.number("H"), fields.take(size)
            require(check == hash64(entry + content) & 0xFFFF and stream % 8 < len(PACKED), "a packed stream is damaged")
            key = PACKED[stream % 8], 0, stream // 8
            require(key not in streams, "a stream is there twice")
            streams[key], at = content, fields.at
        return streams

    def chunks(self, data):
        """All chunks in file order: this decoder reads whole files, and checks indices against what it found."""
        at, digest, found, listed, index = 25, hash64(data[:25]), [], 0, []
        footer = None
        while at < len(data):
            if data[at : at + 2] != b"\xa5\x4d":
                footer = Fields(data, at)
                offset, claimed = footer.number("Q"), footer.number("Q")
                require(footer.take(4) == b"\x89END", "what stands here is no chunk and no footer")
                require(claimed == hash64(struct.pack("<QQ", digest, offset)), "the digest is wrong")
                entries = Fields(b"".join(chunk.content for chunk in index))
                for chunk in found[listed:] if offset else []:
                    entry = entries.take(4), *(entries.count() for _ in range(4)), entries.number("Q")
                    require(entry == chunk.entry, "the index tells of another chunk")
                entries.end()
                at, index, listed = footer.at, [], len(found)
                continue
            chunk = Chunk(data, at)
            at = chunk.end
            (index if chunk.type == "INDX" else found).append(chunk)
            if chunk.type != "INDX":
                digest = hash64(struct.pack("<Q", digest) + chunk.header + struct.pack("<Q", chunk.checksum))
        require(footer and footer.at == len(data), "the file is cut off")
        return found

    def stream(self, kind, patch=0, number=0):
        require((kind, patch, number) in self.streams, f"stream {kind} {patch} {number} is missing")
        return self.streams[kind, patch, number]

    def has(self, kind, patch=0, number=0):
        return (kind, patch, number) in self.streams
