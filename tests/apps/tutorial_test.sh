#!/usr/bin/env bash
# tutorial_test.sh PROGRAM SOURCE_FOLDER WORK_FOLDER: runs the shell blocks of docs/tutorial.md in an empty folder, in their order.
set -u
program=$1 source=$2 work=$3
rm -rf "$work" && mkdir -p "$work/bin" "$work/here" && ln -s "$program" "$work/bin/topple"
export PATH="$work/bin:$PATH"
cd "$work/here" || exit 1
awk '/^```sh$/ {inside = 1; ++n; next} /^```/ {inside = 0} inside {print > ("../block" sprintf("%02d", n))}' "$source/docs/tutorial.md"
blocks=(../block*)
[ ${#blocks[@]} -ge 8 ] || { echo "only ${#blocks[@]} blocks"; exit 1; }
for block in "${blocks[@]}"; do
  # 3: a criterion of the plan is broken, which the run has said
  bash -eu "$block" >out.txt 2>err.txt </dev/null; code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || { echo "exit code $code:"; cat "$block"; tail -20 out.txt err.txt; exit 1; }
  [ "$block" != ../block01 ] || grep -q "All 10 checks are ok" out.txt || { cat out.txt; exit 1; }
  cat out.txt err.txt >>../said.txt
done
failures=0
says() { grep -qF -- "$1" ../said.txt || { echo "nobody said: $1"; failures=$((failures + 1)); }; }
exists() { [ -s "$1" ] || { echo "no file $1"; failures=$((failures + 1)); }; }
says 'wrong.toml:112:1: error E203: charge[0]: unknown key "destoryed_length"'
says 'wrong.toml:124:1: error E203: charge[0]: unknown key "destoryed_length"'; says "2 errors. Nothing was run."; says "exit code 2"
says "Mechanism"; says "Shed"; says "necessity"
# what step 8 recalls
says "No distance given here is a safe distance."
for file in demo/record.h5 out/record.h5 near/record.h5 bars/record.h5 both/compare.json study/results.json; do exists $file; done
[ ! -s "$source/web/dist/report.html" ] || grep -q '<html lang="de">' bericht.html || { echo "bericht.html is not German"; failures=$((failures + 1)); }
exit $((failures > 0))
