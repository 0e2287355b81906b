#!/bin/sh
# Installs libdipole alone (no C++, no OpenGL), static and shared, and builds tests/outside against it by
# CMake and by pkg-config. Oracle: the outside program runs and prints marble's reflectance; the header
# compiles alone as C and as C++; only dipole_ symbols are exported.
set -eu
source_folder=$1
work=$2
rm -rf "$work"
mkdir -p "$work"
count=0

check() { # what, expected, found
    if [ "$2" != "$3" ]; then
        printf '[  FAILED  ] %s: found "%s", expected "%s"\n' "$1" "$3" "$2"
        exit 1
    fi
    printf '[       OK ] %s\n' "$1"
    count=$((count + 1))
}

version=$(sed -n 's/^#define DIPOLE_VERSION "\(.*\)"/\1/p' "$source_folder/libdipole/dipole.h")
expected="libdipole $version: marble reflects 0.7911"
for kind in static shared; do
    [ $kind = shared ] && shared=ON || shared=OFF
    prefix=$work/$kind/prefix
    cmake -S "$source_folder" -B "$work/$kind/build" -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=$shared \
        -DDIPOLE_TOOLS=OFF -DDIPOLE_TESTS=OFF -DDIPOLE_WERROR=ON \
        -DCMAKE_INSTALL_PREFIX="$prefix" >"$work/log" 2>&1 &&
        cmake --build "$work/$kind/build" --target install >>"$work/log" 2>&1 ||
        { cat "$work/log"; exit 1; }

    cmake -S "$source_folder/tests/outside" -B "$work/$kind/outside" -DCMAKE_PREFIX_PATH="$prefix" \
        >"$work/log" 2>&1 && cmake --build "$work/$kind/outside" >>"$work/log" 2>&1 ||
        { cat "$work/log"; exit 1; }
    check "$kind, found by CMake" "$expected" "$("$work/$kind/outside/outside")"

    pc=$(dirname "$(find "$prefix" -name dipole.pc)")
    # shellcheck disable=SC2046  # flags are meant to be split
    cc "$source_folder/tests/outside/main.c" -o "$work/$kind/by_pkg_config" \
        $(PKG_CONFIG_PATH=$pc pkg-config --cflags --libs --static dipole)
    check "$kind, found by pkg-config" "$expected" \
        "$(LD_LIBRARY_PATH=$(dirname "$pc") "$work/$kind/by_pkg_config")"
    check "$kind, version in dipole.pc" "$version" "$(PKG_CONFIG_PATH=$pc pkg-config --modversion dipole)"
done

echo '#include <libdipole/dipole.h>' >"$work/alone.c"
cp "$work/alone.c" "$work/alone.cpp"
cc -std=c11 -Wall -Wextra -Wconversion -Werror -pedantic -I"$prefix/include" -c "$work/alone.c" -o "$work/c.o"
c++ -std=c++17 -Wall -Wextra -Werror -pedantic -I"$prefix/include" -c "$work/alone.cpp" -o "$work/cpp.o"
check "header alone as C and C++" "" ""
library=$(find "$work/shared/prefix" -name 'libdipole.so')
strangers=$(nm -D --defined-only "$library" | awk '$3 !~ /^dipole_/ { print $3 }')
check "exported symbols that do not begin with dipole_" "" "$strangers"
needed=$(objdump -p "$library" | awk '/NEEDED/ { print $2 }' | grep -v -e '^libm\.' -e '^libc\.' || true)
check "libraries needed beside libm and libc" "" "$needed"
printf '[  PASSED  ] %s test(s).\n' "$count"
