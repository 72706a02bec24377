"""Sections 2 to 7 of docs/format.md: fields, checksums, chunks and packed files."""
import struct
import numpy as np

class Unread(Exception):
    """What this decoder leaves out of the text."""

MORE = {}  # by name, what more/ adds

def beyond(name):
    """What goes beyond the core, if it has been added."""
    if name not in MORE:
        raise Unread(name)
    return MORE[name]

M64 = 2**64 - 1
# XXH3's published secret: 192 bytes that any implementation has.
SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671fcb79e64eccc0e578825ad07dccff7221"
    "b8084674f743248ee03590e6813a264c3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364eac5ac8334d3ebc3c581a0fffa1363eb"
    "170ddd51b7f0da49d316552629d4689e2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e")
P32 = (0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D)
P64 = (0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5)
SHORT = (33, P64[1]), (29, P64[2]), (32, 1)
LONG = (37, 0x165667919E3779F9), (32, 1)

def _word(x, at, size=8): return int.from_bytes(x[at : at + size], "little")
def _key(at): return _word(SECRET, at) ^ _word(SECRET, at + 8)
def _fold(a, b): return a * b & M64 ^ a * b >> 64

def _avalanche(h, steps):
    h &= M64
    for shift, factor in steps:
        h = (h ^ h >> shift) * factor & M64
    return h

def _mix16(x, at, secret):
    return _fold(_word(x, at) ^ _word(SECRET, secret), _word(x, at + 8) ^ _word(SECRET, secret + 8))

def _long_hash(x):
    """Stripes of 64 bytes are added to eight sums, 16 to a block, which then are scrambled."""
    words = np.frombuffer(x, "<u8", len(x) // 64 * 8).reshape(-1, 8)
    sums = np.array([P32[2], *P64[:4], P32[1], P64[4], P32[0]], "u8")
    keys = np.array([np.frombuffer(SECRET, "<u8", 8, 8 * i) for i in range(16)])

    def accumulate(stripes, secrets):
        keyed = stripes ^ secrets
        low, high = keyed & np.uint64(2**32 - 1), keyed >> np.uint64(32)
        return sums + (low * high + stripes[:, np.arange(8) ^ 1]).sum(0, np.uint64)

    blocks, stripes = (len(x) - 1) // 1024, (len(x) - 1) // 64
    for block in range(blocks):
        sums = accumulate(words[16 * block : 16 * block + 16], keys)
        sums = (sums ^ sums >> np.uint64(47) ^ np.frombuffer(SECRET, "<u8", 8, 128)) * np.uint64(P32[0])
    sums = accumulate(words[16 * blocks : stripes], keys[: stripes - 16 * blocks])
    sums = accumulate(np.frombuffer(x[-64:], "<u8").reshape(1, 8), np.frombuffer(SECRET, "<u8", 8, 121)).tobytes()
    return _avalanche(len(x) * P64[0] + sum(_mix16(sums, 16 * i, 11 + 16 * i) for i in range(4)), LONG)

def hash64(x):
    """Section 2: XXH3 with 64 bits and seed 0."""
    n = len(x)
    if n == 0:
        return _avalanche(_key(56), SHORT)
    if n <= 3:
        key = _word(SECRET, 0, 4) ^ _word(SECRET, 4, 4)
        return _avalanche((x[0] << 16 | x[n >> 1] << 24 | x[-1] | n << 8) ^ key, SHORT)
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
    if n <= 128:
        pairs = ((16 * i, n - 16 * i - 16, 32 * i) for i in range((n + 31) // 32))
        return _avalanche(n * P64[0] + sum(_mix16(x, a, s) + _mix16(x, b, s + 16) for a, b, s in pairs), LONG)
    h = _avalanche(n * P64[0] + sum(_mix16(x, 16 * i, 16 * i) for i in range(8)), LONG)
    h += sum(_mix16(x, 16 * i, 16 * i - 125) for i in range(8, n // 16))
    return _avalanche(h + _mix16(x, n - 16, 119), LONG)

def unzigzag(u): return u >> 1 if u % 2 == 0 else -(u + 1 >> 1)

def wrap(x, size):
    """10.1: the signed number of `size` bits."""
    x &= (1 << size) - 1
    return x - (1 << size) if x >> size - 1 else x

def clamp(x, low, high): return max(low, min(x, high))

class Fields:
    """Section 2: fields one after the other."""

    def __init__(self, data, at=0):
        self.data, self.at = bytes(data), at

    def take(self, n):
        self.at += n
        assert self.at <= len(self.data), "a field ends early"
        return self.data[self.at - n : self.at]

    def numbers(self, kinds):
        return struct.unpack("<" + kinds, self.take(struct.calcsize("<" + kinds)))

    def number(self, kind): return self.numbers(kind)[0]
    def f64(self): return self.number("d")
    def u8(self): return self.take(1)[0]

    def count(self):
        value, shift, byte = 0, 0, 128
        while byte > 127:
            byte = self.u8()
            value, shift = value | (byte & 127) << shift, shift + 7
        return value

    def zigzag(self): return unzigzag(self.count())
    def section(self): return self.take(self.count())
    def text(self): return self.section().decode("utf-8", "surrogateescape")
    def list(self, item): return [item() for _ in range(self.count())]
    def rest(self): return self.take(len(self.data) - self.at)

    def end(self):
        assert self.at == len(self.data), "bytes behind the last field"

class Container:
    """Sections 3 to 7: `streams` of a file by type, patch and number."""

    def __init__(self, data):
        magic, self.required, _, self.mode, check = Fields(data).numbers("12sIIBI")
        assert magic == b"\x89MAI\r\n\x1a\n\0\0\2\0" and check == hash64(data[:21]) & 0xFFFFFFFF, "another header"
        self.streams = self.packed(data) if self.required & 2 else self.chunked(data)

    @staticmethod
    def packed(data):
        """Section 7."""
        assert data[-8:] == hash64(data[:-8]).to_bytes(8, "little"), "a packed file is damaged"
        fields, streams = Fields(data[:-8], 25), {}
        while fields.at < len(fields.data):
            begin, stream, size = fields.at, fields.count(), fields.count()
            entry, check, content = data[begin : fields.at], fields.number("H"), fields.take(size)
            assert check == hash64(entry + content) & 0xFFFF, "a packed stream is damaged"
            streams["DESC TOPO POSI TWIN ARRY ORDR".split()[stream % 8], 0, stream // 8] = content
        return streams

    @staticmethod
    def chunked(data):
        """Chunks in the order of the file; indices and footers are held against what was found before them."""
        fields, digest, entries, index, parts = Fields(data, 25), hash64(data[:25]), b"", b"", {}
        while fields.at < len(data):
            begin = fields.at
            if data[begin : begin + 2] != b"\xa5\x4d":
                offset, claimed, magic = fields.numbers("QQ4s")
                assert magic == b"\x89END" and claimed == hash64(struct.pack("<QQ", digest, offset)), "another digest"
                assert index == (entries if offset else b""), "the index tells of other chunks"
                entries = index = b""
                continue
            type_ = fields.take(6)[2:].decode("latin-1")
            patch, number, part, size = (fields.count() for _ in range(4))
            entry, check = data[begin + 2 : fields.at], fields.number("H")
            header, content = data[begin : fields.at], fields.take(size)
            assert check == hash64(header[:-2]) & 0xFFFF, "a chunk's header is damaged"
            hashed, checksum = hash64(header + content), fields.take(8)
            assert hashed.to_bytes(8, "little") == checksum, "a chunk's content is damaged"
            if type_ == "INDX":
                index += content
            else:
                entries, digest = entries + entry + checksum, hash64(struct.pack("<Q", digest) + header + checksum)
                parts.setdefault((type_, patch, number), {})[part] = content
        for by_part in parts.values():
            last = len(by_part) - 1
            assert sorted(by_part) == [2 * i + (i == last) for i in range(last + 1)], "a stream lacks a part"
        return {key: b"".join(by_part[i] for i in sorted(by_part)) for key, by_part in parts.items()}

    def stream(self, kind, patch=0, number=0): return self.streams[kind, patch, number]
    def has(self, kind, patch=0, number=0): return (kind, patch, number) in self.streams
