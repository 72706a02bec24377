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


def _u64(x, at):
    return int.from_bytes(x[at : at + 8], "little")


def _u32(x, at):
    return int.from_bytes(x[at : at + 4], "little")


def _fold(a, b):
    product = a * b
    return (product & M64) ^ (product >> 64)


def _avalanche(h):
    h ^= h >> 37
    h = h * 0x165667919E3779F9 & M64
    return h ^ h >> 32


def _xxh64_avalanche(h):
    h ^= h >> 33
    h = h * P64[1] & M64
    h ^= h >> 29
    h = h * P64[2] & M64
    return h ^ h >> 32


def _mix16(x, at, secret):
    return _fold(_u64(x, at) ^ _u64(SECRET, secret), _u64(x, at + 8) ^ _u64(SECRET, secret + 8))


def _long_hash(x):
    """Stripes of 64 bytes are added to eight sums, 16 to a block, which then are scrambled."""
    words = np.frombuffer(x, "<u8", len(x) // 8)
    sums = np.array([P32[2], P64[0], P64[1], P64[2], P64[3], P32[1], P64[4], P32[0]], np.uint64)
    swap = np.arange(8) ^ 1

    def accumulate(sums, stripes, secrets):
        keyed = stripes ^ secrets
        low, high = keyed & np.uint64(0xFFFFFFFF), keyed >> np.uint64(32)
        return sums + (low * high + stripes[:, swap]).sum(0, np.uint64)

    keys = np.array([[_u64(SECRET, 8 * i + 8 * lane) for lane in range(8)] for i in range(16)], np.uint64)
    scramble = np.frombuffer(SECRET, "<u8", 8, 128)
    blocks = (len(x) - 1) // 1024
    for block in range(blocks):
        sums = accumulate(sums, words[128 * block : 128 * block + 128].reshape(16, 8), keys)
        sums = ((sums ^ (sums >> np.uint64(47))) ^ scramble) * np.uint64(P32[0])
    left = ((len(x) - 1) - 1024 * blocks) // 64
    if left:
        sums = accumulate(sums, words[128 * blocks : 128 * blocks + 8 * left].reshape(left, 8), keys[:left])
    last = np.frombuffer(x[-64:], "<u8").reshape(1, 8)
    sums = accumulate(sums, last, np.frombuffer(SECRET, "<u8", 8, 121).reshape(1, 8))
    h = len(x) * P64[0] & M64
    for i in range(0, 8, 2):
        h += _fold(int(sums[i]) ^ _u64(SECRET, 11 + 8 * i), int(sums[i + 1]) ^ _u64(SECRET, 19 + 8 * i))
    return _avalanche(h & M64)


def hash64(x):
    """Section 2: XXH3 with 64 bits and seed 0."""
    n = len(x)
    if n == 0:
        return _xxh64_avalanche(_u64(SECRET, 56) ^ _u64(SECRET, 64))
    if n <= 3:
        combined = x[0] << 16 | x[n >> 1] << 24 | x[-1] | n << 8
        return _xxh64_avalanche(combined ^ _u32(SECRET, 0) ^ _u32(SECRET, 4))
    if n <= 8:
        h = _u32(x, n - 4) + (_u32(x, 0) << 32) ^ _u64(SECRET, 8) ^ _u64(SECRET, 16)
        h ^= ((h << 49 | h >> 15) ^ (h << 24 | h >> 40)) & M64
        h = h * 0x9FB21C651E98DF25 & M64
        h = (h ^ (h >> 35) + n) * 0x9FB21C651E98DF25 & M64
        return h ^ h >> 28
    if n <= 16:
        low = (_u64(SECRET, 24) ^ _u64(SECRET, 32)) ^ _u64(x, 0)
        high = (_u64(SECRET, 40) ^ _u64(SECRET, 48)) ^ _u64(x, n - 8)
        return _avalanche(n + int.from_bytes(low.to_bytes(8, "big"), "little") + high + _fold(low, high) & M64)
    h = n * P64[0]
    if n <= 128:
        for i in range((n - 1) // 32, -1, -1):
            h += _mix16(x, 16 * i, 32 * i) + _mix16(x, n - 16 * i - 16, 32 * i + 16)
        return _avalanche(h & M64)
    if n <= 240:
        h = _avalanche(h + sum(_mix16(x, 16 * i, 16 * i) for i in range(8)) & M64)
        h += sum(_mix16(x, 16 * i, 16 * (i - 8) + 3) for i in range(8, n // 16))
        return _avalanche(h + _mix16(x, n - 16, 136 - 17) & M64)
    return _long_hash(x)


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

    def u32(self):
        return self.number("I")

    def u64(self):
        return self.number("Q")

    def f32(self):
        return self.number("f")

    def f64(self):
        return self.number("d")

    def count(self, most=M64):
        value = shift = 0
        while True:
            byte = self.u8()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
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

    def left(self):
        return len(self.data) - self.at

    def end(self):
        require(self.left() == 0, "bytes behind the last field")


def unzigzag(u):
    return u >> 1 if u % 2 == 0 else -(u + 1 >> 1)


KNOWN = {b"INDX", b"DESC", b"TOPO", b"POSI", b"TWIN", b"ARRY", b"JOIN", b"ORDR", b"CELL", b"TAIL", b"STEP", b"SVAL"}
KNOWN |= {b"PIEC", b"GIDS", b"PIDX", b"SIDX", b"CTAB", b"CDIR", b"CIDX", b"CHRT"}


class Chunk:
    """Section 4."""

    def __init__(self, data, at, end):
        fields = Fields(data[:end], at)
        require(fields.take(2) == b"\xa5\x4d", "no chunk stands here")
        self.type = fields.take(4)
        self.patch, self.number, self.part = (fields.count(2**32 - 1) for _ in range(3))
        self.size = fields.count(1 << 20)
        checked = hash64(data[at : fields.at]) & 0xFFFF
        require(fields.number("H") == checked, "a chunk's header is damaged")
        self.header = data[at : fields.at]
        self.begin = fields.at
        self.content = fields.take(self.size)
        content_hash = hash64(data[at : fields.at])
        self.checksum = fields.u64()
        require(self.checksum == content_hash, "a chunk's content is damaged")
        self.end = fields.at

    def entry(self):
        return self.type, self.patch, self.number, self.part, self.size, self.checksum


class Container:
    """Sections 3 to 7: the streams of a file, by type, patch and number."""

    def __init__(self, data):
        require(data[:8] == b"\x89MAI\x0d\x0a\x1a\x0a" and len(data) >= 45, "no maille file")
        header = Fields(data, 8)
        self.major, self.minor = header.number("H"), header.number("H")
        self.required, self.optional, self.mode = header.u32(), header.u32(), header.u8()
        require(header.u32() == hash64(data[:21]) & 0xFFFFFFFF, "the header is damaged")
        require((self.major, self.minor) == (0, 2), "another version of the format")
        require(self.required < 2 and self.mode < 3, "a feature or mode that is not known")
        self.data, self.chunks = data, []
        self.footers = []  # 16.9: how many chunks there were before each footer
        self._scan()
        self.streams = {}
        for chunk in self.chunks:
            parts = self.streams.setdefault((chunk.type.decode(), chunk.patch, chunk.number), {})
            require(chunk.part >> 1 not in parts, "a stream has a part twice")
            parts[chunk.part >> 1] = chunk
        for key, parts in self.streams.items():
            require(sorted(parts) == list(range(len(parts))), "a stream lacks a part")
            require([i for i in parts if parts[i].part & 1] == [len(parts) - 1], "the last part of a stream is not marked")
            self.streams[key] = b"".join(parts[i].content for i in range(len(parts)))

    def _scan(self):
        """All chunks in file order: this decoder reads whole files, and checks indices against what it found."""
        data, at, index = self.data, 25, []
        digest = hash64(data[:25])
        while at < len(data):
            if data[at : at + 2] != b"\xa5\x4d":
                at, index = self._footer(at, digest, index)
                continue
            chunk = Chunk(data, at, len(data))
            at = chunk.end
            if chunk.type == b"INDX":
                index.append((at, chunk))
                continue
            require(not index, "a chunk behind the index")
            self.chunks.append(chunk)
            digest = hash64(digest.to_bytes(8, "little") + chunk.header + chunk.checksum.to_bytes(8, "little"))
        require(self.footers and at == len(data), "the file is cut off")

    def _footer(self, at, digest, index):
        footer = Fields(self.data, at)
        offset, claimed = footer.u64(), footer.u64()
        require(footer.take(4) == b"\x89END", "what stands here is no chunk and no footer")
        require(claimed == hash64(digest.to_bytes(8, "little") + offset.to_bytes(8, "little")), "the digest is wrong")
        first = self.footers[-1] if self.footers else 0
        if offset:
            entries = Fields(b"".join(chunk.content for _, chunk in index))
            for chunk in self.chunks[first:]:
                entry = entries.take(4), *(entries.count() for _ in range(4)), entries.u64()
                require(entry == chunk.entry(), "the index tells of another chunk")
            entries.end()
        else:
            require(not index, "an index that the footer does not know")
        self.footers.append(len(self.chunks))
        return footer.at, []

    def check_types(self):
        for chunk in self.chunks:
            require(chunk.type in KNOWN or chunk.type[:1].islower(), "a critical chunk of an unknown type")

    def stream(self, kind, patch=0, number=0):
        require((kind, patch, number) in self.streams, f"stream {kind} {patch} {number} is missing")
        return self.streams[kind, patch, number]

    def has(self, kind, patch=0, number=0):
        return (kind, patch, number) in self.streams
