#!/usr/bin/env bash
# tutorial_test.sh PROGRAM SOURCE_FOLDER WORK_FOLDER [STEP]: runs the shell blocks of docs/tutorial.md in an empty folder, in their
# order, and compares what they say with a block without a language behind them; or those of one step, which must stand by itself.
set -u
program=$1 source=$2 work=$3 step=${4:-}
rm -rf "$work" && mkdir -p "$work/bin" "$work/here" && ln -s "$program" "$work/bin/topple"
export PATH="$work/bin:$PATH"
cd "$work/here" || exit 1
awk -v wanted="$step" '/^## / {step = int($2)}
  wanted != "" && step != wanted {next}
  /^```sh$/ {file = sprintf("../block%02d", ++n); next}
  /^```$/ && file == "" {file = sprintf("../said%02d", n); next}
  /^```/ {file = ""; next}
  file != "" {print > file}' "$source/docs/tutorial.md"
blocks=(../block*)
[ ${#blocks[@]} -ge 8 ] || [ -n "$step" ] || { echo "only ${#blocks[@]} blocks"; exit 1; }
failures=0 compared=0
for block in "${blocks[@]}"; do
  # 3: a criterion of the plan is broken, which the run has said
  bash -eu "$block" >out.txt 2>&1 </dev/null; code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || { echo "exit code $code:"; cat "$block"; tail -20 out.txt; exit 1; }
  [ -n "$step" ] || [ "$block" != ../block01 ] || grep -q "All 10 checks are ok" out.txt || { cat out.txt; exit 1; }
  if [ -e "${block/block/said}" ]; then
    diff "${block/block/said}" out.txt || { echo "docs/tutorial.md says something else behind:"; cat "$block"; failures=$((failures + 1)); }
    compared=$((compared + 1))
  fi
  cat out.txt >>../all.txt
done
[ $compared -gt 0 ] || { echo "nothing compared"; failures=$((failures + 1)); }
[ -z "$step" ] || exit $((failures > 0))
says() { grep -qF -- "$1" ../all.txt || { echo "nobody said: $1"; failures=$((failures + 1)); }; }
exists() { [ -s "$1" ] || { echo "no file $1"; failures=$((failures + 1)); }; }
says "Mechanism"; says "Shed"; says "necessity"
# what step 8 recalls
says "No distance given here is a safe distance."
for file in demo/record.h5 out/record.h5 near/record.h5 bars/record.h5 both/compare.json study/results.json; do exists $file; done
[ ! -s "$source/web/dist/report.html" ] || grep -q '<html lang="de">' bericht.html || { echo "bericht.html is not German"; failures=$((failures + 1)); }
exit $((failures > 0))
