#!/usr/bin/env bash
# installed_test.sh BUILD_FOLDER CMAKE WORK_FOLDER: installs, and follows every link of the documents there.
set -u
build=$1 cmake=$2 work=$3
rm -rf "$work" && mkdir -p "$work" && cd "$work" || exit 1
"$cmake" --install "$build" --prefix "$work/root" >log 2>&1 || { tail -20 log; exit 1; }
failures=0 links=0
while IFS= read -r page; do
  while IFS= read -r link; do
    links=$((links + 1))
    [ -e "$(dirname "$page")/$link" ] || { echo "$page links to $link"; failures=$((failures + 1)); }
  done < <(grep -oE '\]\([^)#:]+[)#]' "$page" | sed -e 's/^](//' -e 's/[)#]$//')
done < <(find root/share/doc/topple -name '*.md')
[ $links -gt 100 ] || { echo "only $links links"; exit 1; }
exit $((failures > 0))
