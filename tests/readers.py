"""Tables as other programs read them: by their attributes alone, docs/formats.md.

Oracle: what the program dipole says of the same material.
usage: readers.py PROGRAMS MATERIALS WORK oiio|stdlib
"""
import json
import math
import struct
import subprocess
import sys

PROGRAMS, MATERIALS, WORK, LIBRARY = sys.argv[1:5]
RADII_MM = [0, 0.01, 0.1, 0.37, 1, 2.5, 6, 11]


# Both have attribute(name), without "dipole:"; texel(x, y, slice); width of a slice; value_bytes.
class ExrTable:
    def __init__(self, path):
        import OpenImageIO
        self.picture = OpenImageIO.ImageBuf(path)
        if self.picture.has_error:
            raise SystemExit(self.picture.geterror())
        self.spec = self.picture.spec()
        size = self.attribute("size")
        self.width = int(size[0]) if isinstance(size, tuple) else self.spec.width
        self.value_bytes = {"float": 4, "half": 2}[str(self.picture.spec().format)]

    def attribute(self, name):
        value = self.spec.getattribute("dipole:" + name)
        if value is None:
            raise SystemExit("no attribute dipole:" + name)
        return json.loads(value) if name.endswith("_json") else value

    def texel(self, x, y, z=0):
        return self.picture.getpixel(z * self.width + x, y)[:3]


class RawTable:
    def __init__(self, path):
        with open(path, "rb") as file:
            self.data = file.read()
        with open(path + ".json", encoding="utf-8") as file:
            self.sidecar = json.load(file)
        found = 0xcbf29ce484222325
        for byte in self.data:
            found = (found ^ byte) * 0x100000001b3 % 2**64
        check("%016x" % found == self.sidecar["content_hash"], path + ": the sidecar is of another file")
        self.width = self.sidecar["width"]
        self.channels = {"rgb": 3, "rgba": 4}[self.sidecar["format"].rstrip("0123456789f")]
        self.value_bytes = {"16f": 2, "32f": 4}[self.sidecar["format"][-3:]]

    def attribute(self, name):
        return self.sidecar["attributes"]["dipole:" + name]

    def texel(self, x, y, z=0):
        sidecar = self.sidecar
        at = (sidecar["header_bytes"] + z * sidecar["slice_bytes"] + y * sidecar["row_bytes"] +
              x * self.channels * self.value_bytes)
        return struct.unpack_from("<3" + {2: "e", 4: "f"}[self.value_bytes], self.data, at)


def check(is_right, message):
    if not is_right:
        raise SystemExit(message)


def dipole(material, *arguments):
    """The channels of dipole --json."""
    result = subprocess.run([PROGRAMS + "/dipole", "%s/%s.json" % (MATERIALS, material), "--json", *arguments],
                            check=True, stdout=subprocess.PIPE)
    return json.loads(result.stdout)["channels"]


def splat_sample(table, row, r_mm, of):
    """R_d(r); of: the row's lengths and numbers, as a function of their names."""
    if r_mm > of("r_max_mm"):
        return [0, 0, 0]
    w, most = (1 + (x / of("scale_mm"))**2 for x in (r_mm, of("r_max_mm")))
    power = of("power")
    u = math.log(w) / math.log(most) if power == 0 else (w**power - 1) / (most**power - 1)
    index = u * (table.width - 1)
    i = min(int(index), table.width - 2)
    a, b = table.texel(i, row), table.texel(i + 1, row)
    return [scale * w**-of("falloff") * (p + (q - p) * (index - i)) for p, q, scale in zip(a, b, of("scale"))]


def check_row(table, row, material, stated, of):
    channels = dipole(material, "--at", ",".join(map(str, RADII_MM)))
    count = 0
    for k, r_mm in enumerate(RADII_MM):
        found = splat_sample(table, row, r_mm, of)
        for c, channel in enumerate(channels):
            expected = channel["profile"][k]["rd_per_mm2"]
            # beyond a channel's own r_max the error is relative to R_d there, which is more: left out here
            if r_mm <= channel["r_max_mm"] and r_mm <= of("r_max_mm"):
                check(abs(found[c] - expected) <= stated * expected + 1e-300,
                      "%s, r = %g mm, channel %d: %g, expected %g" % (material, r_mm, c, found[c], expected))
                count += 1
    check(count > 12, material + ": too few radii were compared")


def linear(values, index):
    i = min(int(index), len(values) - 2)
    return values[i] + (values[i + 1] - values[i]) * (index - i)


def check_volume(table, material):
    """A flat surface across the light, lit evenly: every entry of the pattern, with cosine 0 and dz = 0, and the
    local response; what leaves is the diffuse reflectance."""
    size = [int(n) for n in table.attribute("size")]
    scale = table.attribute("scale")
    local, factors = int(table.attribute("local_slice")), int(table.attribute("depth_factor_slice"))
    cell_mm2 = table.attribute("local_width_mm")**2
    factor = table.texel(0, 0, factors)
    for c, channel in enumerate(dipole(material)):
        total = 0
        for r, sample in enumerate(table.attribute("pattern_json")):
            rows = [linear([table.texel(x, y, r)[c] for x in range(size[0])], 0.5 * (size[0] - 1))
                    for y in range(size[1])]
            total += linear(rows, 0.5 * (size[1] - 1)) * scale[c] * sample["area_mm2"]
        kernel = sum(table.texel(x, y, local)[c] for y in range(7) for x in range(7))
        total += kernel * scale[c] * cell_mm2 * factor[c]
        expected = channel["diffuse_reflectance"]
        check(abs(total - expected) <= 0.01 * expected,
              "%s, channel %d: %g of the light leaves, expected %g" % (material, c, total, expected))


def main():
    if LIBRARY == "oiio":
        try:
            import OpenImageIO  # noqa: F401
        except ImportError as error:
            print("[  SKIPPED ] OpenImageIO's Python module: %s" % error)
            return
        suffix, read = "exr", ExrTable
    else:
        suffix, read = "raw", RawTable
    suffixes = [suffix] if suffix == "exr" else ["raw", "dds"]
    for storage, value_bytes in (("float", 4), ("half", 2)):
        for suffix in suffixes:
            path = "%s/%s/%%s.%s" % (WORK, storage, suffix)
            for material in ("marble", "ketchup"):
                table = read(path % (material + ".splat1d"))
                check(table.value_bytes == value_bytes, "stored in %d bytes" % table.value_bytes)
                check(int(table.attribute("size")) == table.width, "size is not the width")
                check_row(table, 0, material, table.attribute("max_relative_error"), table.attribute)
                check_volume(read(path % (material + ".tsm")), material)
            table = read(path % "materials.splat2d")
            rows = table.attribute("row_json")
            check([row["material"] for row in rows] == ["Marble", "Ketchup"], "rows of other materials")
            for k, material in enumerate(("marble", "ketchup")):
                check_row(table, k, material, rows[k]["max_relative_error"], rows[k].get)
    print("[       OK ] %s: profiles and reflectances by %s" % (", ".join(suffixes), LIBRARY))


main()
