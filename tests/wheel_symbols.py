"""Reads which versions of glibc's symbols and which libraries a shared library of ELF asks for; fails beyond manylinux2014."""

import struct
import sys

NEWEST = (2, 17)
#: Libraries that manylinux2014 has everywhere, and the loader.
ALLOWED = ("libc.so", "libm.so", "libdl.so", "librt.so", "libpthread.so", "libgcc_s.so", "libutil.so", "ld-linux")


def needs(data: bytes) -> tuple[list[str], list[str]]:
    """Libraries (DT_NEEDED), and names of versions (the section .gnu.version_r), of a 64-bit little-endian library."""
    assert data[:6] == b"\x7fELF\x02\x01", "is no 64-bit little-endian ELF"
    table, size, count = struct.unpack_from("<Q", data, 40)[0], *struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, table + i * size) for i in range(count)]
    text = lambda strings, at: data[strings[4] + at : data.index(b"\0", strings[4] + at)].decode()  # noqa: E731
    libraries, versions = [], []
    for section in sections:
        kind, offset, length, link, info = section[1], section[4], section[5], section[6], section[7]
        if kind == 6:  # SHT_DYNAMIC
            for at in range(offset, offset + length, 16):
                tag, value = struct.unpack_from("<QQ", data, at)
                if tag == 1:  # DT_NEEDED
                    libraries.append(text(sections[link], value))
        if kind == 0x6FFFFFFE:  # SHT_GNU_verneed
            at = offset
            for _ in range(info):
                _, entries, _, first, following = struct.unpack_from("<HHIII", data, at)
                entry = at + first
                for _ in range(entries):
                    _, _, _, name, after = struct.unpack_from("<IHHII", data, entry)
                    versions.append(text(sections[link], name))
                    entry += after
                at += following
    return libraries, versions


def main(path: str) -> int:
    with open(path, "rb") as file:
        libraries, versions = needs(file.read())
    glibc = sorted(tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in versions if v.startswith("GLIBC_2"))
    assert glibc, "asks for no version of glibc at all: it was not read rightly"
    print(f"{path.rsplit('/', 1)[-1]}: glibc {'.'.join(map(str, glibc[-1]))}, needs {', '.join(libraries)}")
    wrong = [f"glibc {'.'.join(map(str, v))}" for v in glibc if v > NEWEST]
    wrong += [name for name in libraries if not name.startswith(ALLOWED)]
    if wrong:
        print(f"asks for more than manylinux2014 has: {', '.join(wrong)}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
