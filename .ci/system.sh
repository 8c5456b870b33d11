#!/usr/bin/env bash
# system.sh compiler PYTHON | gtest | bpy PYTHON: says in one line which system package is missing, or nothing. Run by the Makefile.
set -euo pipefail
cxx=${CXX:-c++}
compiles() { echo "$1" | "$cxx" -std=c++20 -fsyntax-only -x c++ - 2>/dev/null; }
missing() { echo "vlp-bpt: $1 is missing; on Debian or Ubuntu: apt-get install $2" >&2; exit 1; }
case $1 in
  compiler) compiles '#include <concepts>
#include <span>
static_assert(__cplusplus >= 202002L);' || missing "a C++20 compiler (\$CXX or c++: GCC 11, Clang 14 or later)" g++
    "$2" -c 'import pathlib, sysconfig, sys; sys.exit(not pathlib.Path(sysconfig.get_path("include"), "Python.h").exists())' ||
      missing "Python.h, which extension modules are compiled with," "$("$2" -c 'import sys; print("python%d.%d-dev" % sys.version_info[:2])')" ;;
  gtest) compiles '#include <gtest/gtest.h>' || missing "GoogleTest" libgtest-dev ;;
  bpy)
    site=$("$2" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    names=$(ldd "$site"/bpy/*.so 2>/dev/null | awk '/not found/ {print $1}' | sort -u | tr '\n' ' ')
    [ -z "$names" ] || missing "what the bpy module needs ($names)" \
      "$(for n in $names; do # libX11.so.6 is in libx11-6, libXi.so.6 in libxi6: Debian's rule
        base=${n%%.so*}; base=${base,,}; version=${n##*.so}; version=${version#.}
        case $base in *[0-9]) echo "$base-$version" ;; *) echo "$base$version" ;; esac
      done | tr '\n' ' ')" ;;
esac
