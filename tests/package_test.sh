#!/usr/bin/env bash
# package_test.sh BUILD_FOLDER CPACK WORK_FOLDER: makes the Debian package and uses it from a root of its own.
set -u
build=$1 cpack=$2 work=$3
rm -rf "$work" && mkdir -p "$work" && cd "$work" || exit 1
failures=0
complain() { echo "$*"; failures=$((failures + 1)); }

"$cpack" -G DEB --config "$build/CPackConfig.cmake" -B "$work/made" >log 2>&1 || { tail -20 log; exit 1; }
shopt -s nullglob
packages=("$work"/made/*.deb)
[ ${#packages[@]} -eq 1 ] || { echo "${#packages[@]} packages"; exit 1; }
deb=${packages[0]}

# what it says of itself
[ "$(dpkg-deb -f "$deb" Package)" = topple ] || complain "another name"
[ "$(dpkg-deb -f "$deb" Version)" = "$(sed -n 's/^set(CPACK_PACKAGE_VERSION "\(.*\)")/\1/p' "$build/CPackConfig.cmake")" ] || complain "another version"
depends=$(dpkg-deb -f "$deb" Depends)
for library in libc6 libstdc++6 libhdf5 libfmt9 libsqlite3-0 libtbb; do
  [[ $depends == *$library* ]] || complain "does not depend on $library: $depends"
done
[[ $depends != *-dev* ]] || complain "depends on development files: $depends"

# what is in it
dpkg-deb -c "$deb" >contents || complain "cannot be listed"
for file in ./usr/bin/topple ./usr/share/man/man1/topple.1.gz ./usr/share/bash-completion/completions/topple \
  ./usr/share/doc/topple/copyright ./usr/share/doc/topple/changelog.gz ./usr/share/doc/topple/examples/weida/plan.toml \
  ./usr/share/doc/topple/docs/getting-started.md; do
  grep -qF " $file" contents || complain "$file is missing"
done
! grep -v '^[dl-][rwx-]* root/root' contents || complain "files of somebody else"

# used from where it is unpacked, without the source tree's pages
dpkg-deb -x "$deb" root || complain "cannot be unpacked"
root/usr/bin/topple doctor >doctor.txt || { cat doctor.txt; complain "topple doctor fails"; }
root/usr/bin/topple new plan.toml >/dev/null || complain "topple new fails"
root/usr/bin/topple run plan.toml -o out --duration "0.2 s" >run.txt 2>&1 # too short for the plan's criteria
[ -s out/record.h5 ] || { cat run.txt; complain "a plan cannot be run"; }
if grep -qF ./usr/share/topple/report.html contents; then [ -s out/report.html ] || complain "no report from the package's page"; fi
! readelf -d root/usr/bin/topple | grep -E 'RPATH|RUNPATH' || complain "looks for libraries in a place of its own"

# a root of its own, as dpkg installs it; the libraries are not there, so nothing is configured
if [ "$(id -u)" = 0 ] && command -v dpkg >/dev/null; then
  mkdir -p fresh/var/lib/dpkg/{info,updates} && : >fresh/var/lib/dpkg/status
  dpkg --root="$work/fresh" --force-not-root --force-depends --unpack "$deb" >unpack.txt 2>&1 || { cat unpack.txt; complain "dpkg cannot unpack it"; }
  [ -x fresh/usr/bin/topple ] || complain "dpkg did not install the program"
  grep -q '^Package: topple' fresh/var/lib/dpkg/status || complain "dpkg does not know it"
fi

if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error "$deb" >lintian.txt 2>&1 || { cat lintian.txt; complain "lintian finds errors"; }
fi
exit $((failures > 0))
