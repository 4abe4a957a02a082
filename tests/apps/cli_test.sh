#!/usr/bin/env bash
# One case of the command line's test: cli_test.sh CASE PROGRAM SOURCE_FOLDER WORK_FOLDER
set -u
case_name=$1 topple=$2 source=$3 work=$4
rm -rf "$work" && mkdir -p "$work" && cd "$work" || exit 1
plan=$source/tests/data/short.toml
failures=0

# expect CODE COMMAND...: runs it, keeps what it wrote in out and err
expect() {
  local wanted=$1; shift
  "$@" >out 2>err
  local got=$?
  if [ "$got" -ne "$wanted" ]; then
    echo "exit code $got instead of $wanted: $*"; head -20 out err; failures=$((failures + 1))
  fi
}
# has FILE TEXT: the file holds the text
has() { grep -qF -- "$2" "$1" || { echo "$1 does not hold: $2"; head -20 "$1"; failures=$((failures + 1)); }; }
lacks() { ! grep -qF -- "$2" "$1" || { echo "$1 holds: $2"; failures=$((failures + 1)); }; }
exists() { [ -s "$1" ] || { echo "no file $1"; failures=$((failures + 1)); }; }
is_json() { python3 -c 'import json,sys; json.load(open(sys.argv[1]))' "$1" || { echo "$1 is not JSON"; failures=$((failures + 1)); }; }
# start FILE TEXT COMMAND...: in the background as $pid, until its out or err holds the text, not that of one before
start() {
  local file=$1 text=$2; shift 2
  rm -f out err
  "$@" >out 2>err &
  pid=$!
  for _ in $(seq 3000); do grep -q "$text" "$file" 2>/dev/null && break; sleep 0.02; done
}

case $case_name in
usage)
  expect 0 "$topple" --help; has out "Examples:"; has out "Exit codes"
  expect 0 "$topple" run --help; has out "--json"
  expect 0 "$topple" --version; has out "topple "
  expect 0 "$topple" version; has out "topple "
  if [ -c /dev/full ]; then
    for words in --help --version "run --help" "help run" "completion bash" manual version; do
      expect 1 sh -c '"$@" >/dev/full' sh "$topple" $words; has err "standard output could not be written"
    done
  fi
  expect 2 "$topple"
  expect 2 "$topple" rnu; has err 'did you mean "run"?'
  expect 2 "$topple" run
  expect 2 "$topple" run "$plan"; has err "--output"
  expect 2 "$topple" run "$plan" -o a --threads 0
  expect 2 "$topple" run "$plan" -o a --duration "3 apples"; has err "--duration"
  expect 2 "$topple" run "$plan" -o a --duration "-3 s"
  expect 2 "$topple" run "$plan" -o a --duration "11 min"; has err '--duration "11 min": must be between 0.01 and 600 s, as in a plan'
  expect 2 "$topple" run "$plan" -o a --step 2; has err '--step "2": must be between 1e-07 and 0.01 s'
  expect 2 "$topple" run "$plan" -o a --engine adams; has err "there is no engine"
  expect 0 "$topple" rules; has out "zone.rupture_rotation = 0.35 rad"; has out "because:"
  expect 0 "$topple" rules --json; is_json out; cp out rules.json
  expect 0 "$topple" check "$plan" --knowledge rules.json
  sed 's/"zone.rupture_rotation"/"zone.rupture_rotatoin"/' rules.json >wrong.json
  expect 2 "$topple" check "$plan" --knowledge wrong.json; has err 'did you mean "zone.rupture_rotation"'
  head -c 200 rules.json >cut.json
  expect 2 "$topple" check "$plan" --knowledge cut.json; has err "cut.json:8:49: "; has err "error E611: this is not JSON"
  ;;
study)
  cat >in.toml <<'TEXT'
title = "Sum"
[inputs]
a = { triangular = [1, 2, 4] }
b = { triangular = [2, 3, 5], unit = "m" }
TEXT
  model='while read -r line; do number() { expr "$line" : ".*\"$1\":\([-0-9.e+]*\)"; }; echo "{\"z\": $(number a), \"outcome\": \"stands\"}"; done'
  expect 0 "$topple" study in.toml --evaluator "$model" -o s --samples 100 --alpha 0.5; has out "0.5"; has out "1.5"; has out stands
  for file in results.json membership.csv outcomes.csv samples.csv study.sqlite; do exists s/$file; done
  is_json s/results.json; has s/membership.csv "z,,0,1,4,"; has s/samples.csv "b [m]"
  has out 'outcome is "stands"'; has out "Drivers"; exists s/drivers.csv
  expect 0 "$topple" study show s; has out "Sum"; has out "z"; has out "Runs to look at"
  expect 0 "$topple" study show s --json; is_json out
  expect 0 "$topple" study export s -o tables; cmp s/samples.csv tables/samples.csv || failures=$((failures + 1))
  cmp s/results.json tables/results.json || failures=$((failures + 1))
  expect 0 "$topple" worker s; has err "every study is finished"
  expect 0 "$topple" worker s --json; is_json out; has out '"done": 0'; has out '"ending": "every study is finished"'
  expect 2 "$topple" study in.toml --evaluator "other" -o s; has err "another model"
  expect 2 "$topple" study in.toml --evaluator "while read -r l; do echo '{\"z\": 1, oops}'; done" -o wrong
  has err "this is not JSON"; has err "^"; has err "oops"
  expect 2 "$topple" study in.toml --evaluator "$model" -o a --alpha 0,2; has err "--alpha"
  expect 2 "$topple" study in.toml --evaluator "$model" -o a --store mysql://x; has err "is no server"
  expect 2 "$topple" study in.toml --evaluator "$model" -o a --store ""; has err "--store"; has err "an address is wanted"
  expect 2 "$topple" study in.toml --evaluator "$model" -o a --name ""; has err "a name is wanted"
  expect 2 "$topple" study in.toml --evaluator "$model" -o a --name x; has err "only a study on a server has a name"
  [ ! -e a ] || { echo "a folder was made for wrong arguments"; failures=$((failures + 1)); }
  expect 1 timeout --preserve-status -s INT 1 "$topple" study in.toml --evaluator "$model" -o a --store postgresql://127.0.0.1:1/none; has err "the store is away"
  [ ! -e a ] || { echo "a folder was made for a server that is away"; failures=$((failures + 1)); }
  expect 2 "$topple" study in.toml --evaluator "$model"; has err "--output"
  expect 2 "$topple" study "$plan" -o a; has err "fuzzy"
  expect 2 "$topple" study show nowhere; has err "there is no study"
  expect 2 "$topple" worker nowhere; has err "there is no study"
  expect 2 "$topple" worker nowhere --json; is_json out; has out '"code": "E820"'
  sed 's/\[1, 2, 4\]/[1, 5, 4]/' in.toml >bad.toml
  expect 2 "$topple" study bad.toml --evaluator "$model" -o a; has err "bad.toml:3"; has err "^"
  expect 2 "$topple" study in.toml --evaluator "$model" -o a --permissible "z << 3"; has err "a number is wanted"
  expect 0 "$topple" study in.toml --evaluator "$model" -o b --samples 300 --permissible "stands, z <= 3" --no-drivers
  has out "Permissible values"; has out "z <= 3"; has out "fresh random points"; lacks out "Drivers"; exists b/boxes.csv
  expect 0 "$topple" study in.toml --evaluator "$model" -o b --samples 300 --permissible "falls"; has out 'No run had the outcome "falls"'; has out "no box"
  # random inputs
  printf '[random]\nx = { normal = ["a", 1] }\n[randomness]\nruns = 10\nstatistics = ["mean(z)", "p(stands)", "p(z > 2)"]\n' | cat in.toml - >random.toml
  drawn='while read -r line; do number() { expr "$line" : ".*\"$1\":\([-0-9.e+]*\)"; }; echo "{\"z\": $(number x), \"outcome\": \"stands\"}"; done'
  expect 0 "$topple" study random.toml --evaluator "$drawn" -o r --samples 40 --no-drivers --permissible "p(z > 2) <= 0.7, mean(z) < 3"
  has err "each point takes 10 runs"; has out "mean(z)"; has out "x is distributed normally with the mean a and the standard deviation 1."; has out "p(z > 2) <= 0.7"
  is_json r/results.json; has r/results.json '"distribution": "normal"'
  expect 0 "$topple" study show r; has out "p(stands)"
  expect 2 "$topple" study random.toml --evaluator "$drawn" -o r --seed 1 --condensed; has err "--condensed"
  sed 's/"a", 1\]/"a", -1]/; s/p(z > 2)/p(z > much)/' random.toml >bad.toml
  expect 2 "$topple" study bad.toml --evaluator "$drawn" -o r2; has err "bad.toml:6"; has err "standard deviation is below 0"; has err "bad.toml:9"; has err "a number is wanted"
  sed 's/mean(z)/mean(y)/' random.toml >bad.toml
  expect 2 "$topple" study bad.toml --evaluator "$drawn" -o r2; has err 'no output "y"'; has err "E825"
  "$topple" new frame.toml --template frame >/dev/null
  printf '[fuzzy.parameters]\nm = { triangular = ["22 N/mm2", "25 N/mm2", "30 N/mm2"] }\n[fuzzy.random]\nconcrete.C25.fc = { lognormal = ["m", "4 N/mm2"] }\nsite.friction = { normal = [0.6, 0.05] }\n[fuzzy.search]\nafter = "1 s"\n[fuzzy.randomness]\nruns = 2\nstatistics = ["p(topple)", "mean(tilt_1)"]\n' >>frame.toml
  expect 0 "$topple" study frame.toml -o rp --samples 10 --alpha 0,1 --no-drivers; has err "each point takes 2 runs"; has out "mean(tilt_1) [deg]"; has out "log-normally with the mean m and the standard deviation 4 N/mm2"
  expect 0 "$topple" study export rp -o rp2; cmp rp/membership.csv rp2/membership.csv || failures=$((failures + 1))
  # the page, where it is built
  if [ -e "$source/web/dist/study.html" ]; then
    exists tables/study.html; has tables/study.html topple-study; has tables/study.html "Sum"
  else
    has err "is not built"
  fi
  # results of former settings do not stay
  expect 0 "$topple" study in.toml --evaluator "$model" -o b --samples 100 --no-drivers
  for file in boxes.csv drivers.csv; do [ ! -e b/$file ] || { echo "b/$file of former settings"; failures=$((failures + 1)); }; done
  exists b/results.json
  # the folder of another study on a server, or of one in a file
  mkdir d; echo '{"store": "postgresql://h/d", "name": "other"}' >d/study.json; cp d/study.json was.json
  for store in "--store postgresql://h/d" "--store postgresql://h/d --name mine" "--store postgresql://g/d --name other" "--name mine"; do
    expect 2 "$topple" study in.toml --evaluator "$model" -o d $store; has err "E822"; has err '"other"'
    cmp d/study.json was.json || failures=$((failures + 1))
  done
  expect 2 "$topple" study in.toml --evaluator "$model" -o b --store postgresql://h/d; has err "E822"; has err "a study in a file"
  [ ! -e b/study.json ] || { echo "b/study.json of a refused study"; failures=$((failures + 1)); }
  # curves of unequal length
  curves='while read -r line; do case $line in *\"a\":3*) t="[1,2,3]" ;; *) t="[1,2]" ;; esac; echo "{\"z\": 1, \"trajectory\": $t}"; done'
  expect 2 "$topple" study in.toml --evaluator "$curves" -o curves --samples 100 --jobs 1; has err "E823"; has err "a trajectory of the length"; has err "^"
  # strict limits
  expect 0 "$topple" study in.toml --evaluator "$model" -o strict --samples 100 --no-drivers --permissible "z > 2"; has out "core values break the requirement z > 2"
  expect 0 "$topple" study in.toml --evaluator "$model" -o strict --samples 100 --no-drivers --permissible "z >= 2"; has out "core values keep the requirement z >= 2"
  # options that cannot be meant
  expect 2 "$topple" study in.toml -o e; has err "in.toml:2"; has err "--evaluator"
  expect 2 "$topple" study in.toml --evaluator "" -o e; has err "a command is wanted"
  expect 2 "$topple" study in.toml --evaluator "$model" --permissible " " -o e; has err "a requirement is wanted"
  expect 2 "$topple" study in.toml --evaluator "$model" --knowledge rules.json -o e; has err "--knowledge"; has err "E801"
  expect 2 "$topple" study in.toml --evaluator "$model" --name x -o e; has err "--name"; has err "E801"
  expect 2 "$topple" study in.toml --evaluator "$model" --seed 9223372036854775808 -o e; has err "2^63"
  for option in "--timeout 5s" --one-shot; do
    expect 2 "$topple" study "$source/examples/weida/plan-fuzzy.toml" $option -o e; has err "E801"; has err "not for a plan"
  done
  expect 2 "$topple" study in.toml --evaluator "$model" -o in.toml; has err "E801"; has err "in.toml"
  expect 2 "$topple" study export s -o in.toml; has err "E801"
  # results that cannot be written
  expect 1 "$topple" study in.toml --evaluator "$model" -o in.toml/e; has err "the folder cannot be made"
  expect 2 "$topple" study in.toml --evaluator /nowhere/model -o e; has err "E827"
  [ ! -e e/study.sqlite ] || { echo "a store without a run"; failures=$((failures + 1)); }
  expect 2 "$topple" study in.toml --evaluator /nowhere/model -o fresh; [ ! -e fresh ] || { echo "a folder without a run"; failures=$((failures + 1)); }
  mkdir mine; expect 2 "$topple" study in.toml --evaluator /nowhere/model -o mine
  [ -d mine ] && [ ! -e mine/study.sqlite ] || { echo "not as it was: mine"; failures=$((failures + 1)); }
  expect 0 "$topple" study in.toml --evaluator "$model" -o e --samples 20
  # a full disk: said once, and no store without an answer
  mkdir -p full
  if unshare -m mount -t tmpfs -o size=64k none full 2>mount.txt; then
    for room in 0 3 12 50; do
      expect 1 unshare -m sh -c 'mount -t tmpfs -o size=64k none full && head -c ${1}k /dev/zero >full/fill && "$2" study in.toml --evaluator "$3" -o full/s; code=$?; find full/s >left.txt 2>&1; exit $code' sh $((64 - room)) "$topple" "$model"
      has err "could not be written"; lacks err "is no study"; has left.txt "No such file"
      [ "$(grep -c study.sqlite err)" -eq 1 ] || { cat err; echo "not said once"; failures=$((failures + 1)); }
    done
    expect 1 unshare -m sh -c 'mount -t tmpfs -o size=300k none full && "$1" study in.toml --evaluator "$2" -o full/s --samples 300; code=$?; find full/s >left.txt 2>&1; exit $code' sh "$topple" "$model"
    has err "could not be written"; has err "What was run before is kept"; has left.txt study.sqlite
  fi
  # all runs fail: told, not hidden
  expect 0 "$topple" study in.toml --evaluator "while read l; do echo '{\"failed\": \"no balance\"}'; done" -o f --samples 10
  has out "no balance"; has out "All 10 runs failed"
  # a study that goes on and whose first new answer is refused: what earlier calls ran is kept, and told
  mends="while read l; do [ -e broken ] && echo '{' || echo '{\"z\": 1}'; done"
  expect 0 "$topple" study in.toml --evaluator "$mends" -o kept --samples 20; : >broken
  expect 2 "$topple" study in.toml --evaluator "$mends" -o kept --samples 40; has err "E824"; has err "what was run before is kept"
  # a model that never answers: told at once, and nothing stays that a mended one would have to clear away
  expect 2 "$topple" study in.toml --evaluator "echo why >&2; exit 3" -o g --samples 1000; has err "E828"; has err "exit code 3: why"
  [ ! -e g/study.sqlite ] || { echo "a store of a model that never answered"; failures=$((failures + 1)); }
  ;;
readme)
  # every command in the shell blocks of these pages exists
  commands=0
  for page in README.md docs/getting-started.md docs/run.md docs/mbs-model.md docs/engines.md docs/rcc.md docs/study.md docs/exports.md docs/imports.md docs/steer.md; do
    while read -r word verb rest; do
      case $word in
      script/*) [ -x "$source/$word" ] || { echo "$page shows $word, which cannot be called"; failures=$((failures + 1)); } ;;
      topple)
        [ "$verb" = mbs ] && verb="mbs ${rest%% *}"
        expect 0 "$topple" $verb --help # two words for mbs
        ;;
      *) continue ;;
      esac
      commands=$((commands + 1))
    done < <(awk '/^```sh/ {inside = 1; next} /^```/ {inside = 0} inside' "$source/$page" | tr '&' '\n')
  done
  [ $commands -ge 8 ] || { echo "only $commands commands found"; failures=$((failures + 1)); }
  # of README's own blocks
  for command in script/demo script/test "topple new" "topple check" "topple run"; do has "$source/README.md" "$command"; done
  ;;
new)
  expect 0 "$topple" new plan.toml; exists plan.toml
  expect 0 "$topple" check plan.toml; has out "no errors"
  echo mine >plan.toml
  expect 2 "$topple" new plan.toml; has err "exists already"
  has plan.toml mine
  expect 1 "$topple" new /proc/nowhere/plan.toml
  expect 0 "$topple" new --list; has out "Frame building"
  for name in $("$topple" new --list | cut -d' ' -f1); do
    expect 0 "$topple" new --template "$name" -o "$name.toml"
    cmp "$name.toml" "$source/examples/templates/$name.toml" || failures=$((failures + 1))
    expect 0 "$topple" check "$name.toml"; has out "no errors, 0 warnings"
  done
  expect 0 "$topple" new --list --json; is_json out; has out '"name": "chimney"'
  expect 0 "$topple" new json.toml --json; is_json out; has out '"plan": "json.toml"'; has err "Wrote json.toml"
  expect 2 "$topple" new json.toml --json; is_json out; has out '"code": "E802"'; has err "exists already"
  expect 2 "$topple" new --template fram -o none.toml --json; is_json out; has out '"code": "E920"'
  expect 2 "$topple" new --template fram -o none.toml; has err 'did you mean "frame"'
  [ ! -e none.toml ] || { echo "a plan for nothing"; failures=$((failures + 1)); }
  expect 2 "$topple" new --template frame; has err "a file to write is required"
  ;;
fe)
  expect 0 "$topple" fe "$plan" --mesh-only --size "30 cm"; has out "553 elements"; has out "No face was moved"
  expect 0 "$topple" fe "$plan" --mesh-only --json; is_json out; has out '"critical_step"'
  expect 0 "$topple" fe "$plan" --mesh-only --scaled-step "0.03 ms" --json; is_json out; has err "elements got"; has err "so that they bear a step of 0.0300 ms"; has out '"added_mass"'
  expect 0 "$topple" fe "$plan" --mesh-only --scaled-step "0.01 ms"; has out "No element needs mass for a step of 0.0100 ms"
  expect 2 "$topple" fe "$plan" --mesh-only --scaled-step "5 ms"; has err "E677"
  expect 3 "$topple" fe "$plan" --size "40 cm" --until "300 ms" -o r; has out "Putting on the dead load"
  has out "Rigid fragments"; has out "Wrote r/record.h5"; exists r/record.h5
  expect 0 "$topple" run "$plan" --no-report -o m; expect 0 "$topple" compare m/record.h5 r/record.h5 -o c
  has out "B  finite elements"; has out "10 of 10 moving bodies"
  expect 2 "$topple" fe "$plan"; has err "--output is required"
  expect 2 "$topple" fe "$plan" --size "4 apples" -o none; has err "--size"
  expect 2 "$topple" fe "$plan" --resume -o none2; has err "checkpoint.bin"
  expect 2 "$topple" fe "$plan" --until "0 s" -o none2; has err "--until"
  echo kept >taken
  expect 2 "$topple" fe "$plan" -o taken; has err "E801"; has err "taken is a file; a folder is wanted"; has taken kept
  expect 2 "$topple" run "$plan" -o taken --json; is_json out; has out '"code": "E801"'; has taken kept
  expect 2 "$topple" fe missing.toml -o none; [ ! -e none ] || { echo "a folder for nothing"; failures=$((failures + 1)); }
  # an interrupt leaves a record and a checkpoint from which it goes on
  start out "stage 1" "$topple" fe "$plan" --size "20 cm" --checkpoint -o cut
  kill -INT $pid; wait $pid; code=$?
  [ $code -eq 1 ] || { echo "exit code $code after an interrupt"; cat out err; failures=$((failures + 1)); }
  has out "Cancelled at"; has out "--resume"; exists cut/checkpoint.bin; exists cut/record.h5
  expect 2 "$topple" fe "$plan" --size "30 cm" --resume -o cut; has err "another plan, mesh, step or version"
  # at another interval, with the bits of a run that was not interrupted
  expect 2 "$topple" fe "$plan" --checkpoint-interval "1 s" -o none2; has err "--checkpoint-interval requires --checkpoint or --resume"
  expect 0 "$topple" fe "$plan" --size "20 cm" --until "500 ms" --resume --checkpoint-interval "0.1 s" --csv --no-report -o cut
  expect 0 "$topple" fe "$plan" --size "20 cm" --until "500 ms" --csv --no-report -o whole
  cmp cut/bodies.csv whole/bodies.csv && cmp cut/series.csv whole/series.csv || failures=$((failures + 1))
  # there is nothing to go on from while the dead load is put on
  start out "Putting on" "$topple" fe "$plan" --size "10 cm" --checkpoint -o early
  kill -INT $pid; wait $pid; code=$?
  [ $code -eq 1 ] || { echo "exit code $code after an early interrupt"; cat out err; failures=$((failures + 1)); }
  lacks out "--resume"; [ ! -e early/checkpoint.bin ] || { echo "a checkpoint of nothing"; failures=$((failures + 1)); }
  # the keyword file
  expect 0 "$topple" export "$plan" --lsdyna --size "40 cm" -o model.k; has out "Wrote model.k"
  cp "$plan" own.toml; expect 2 "$topple" export own.toml --lsdyna -o own.toml; has err "written over"; cmp "$plan" own.toml || failures=$((failures + 1))
  has model.k "*ELEMENT_SOLID"; has model.k "*MAT_PLASTICITY_COMPRESSION_TENSION"; has model.k "*END"
  ;;
records)
  expect 0 "$topple" run "$plan" -o r --no-report
  expect 0 "$topple" compare r/record.h5 r/record.h5 -o c
  has out "A  native (first)"; has out "Mass centres up to then: at most 0.00 m apart"; is_json c/compare.json
  for f in compare.txt compare.csv; do exists c/$f; done
  mkdir -p twin; cp r/record.h5 twin/record.h5
  expect 0 "$topple" compare r/record.h5 twin/record.h5 -o c; has out "A  native (r)"; has out "B  native (twin)"
  lacks err "of one building"
  if [ -s "$source/web/dist/compare.html" ]; then
    # a disk that is full before the page, which is the largest
    (trap '' XFSZ; ulimit -f 600; "$topple" compare r/record.h5 r/record.h5 -o full >out 2>err) && { echo "no failure"; failures=$((failures + 1)); }
    has err "full/compare.html"; [ -z "$(ls -A full)" ] || { echo "half of a comparison"; failures=$((failures + 1)); }
  fi
  expect 0 "$topple" compare r/record.h5 r/record.h5 -o c --json; is_json out; lacks err "Mass centres"
  sed 's/^title = .*/title = "Another"/' "$plan" >another.toml
  expect 3 "$topple" run another.toml -o other --no-report --duration "0.1 s"
  expect 0 "$topple" compare r/record.h5 other/record.h5 -o c; has err 'other/record.h5 is of "Another"'; has err "of one building"
  for f in compare.txt compare.json; do has c/$f Another; has c/$f "of one building"; done
  printf '0.5,missing.png\n' >photos.csv
  expect 2 "$topple" compare r/record.h5 r/record.h5 -o none --photos photos.csv; has err "photos.csv:1:5: error E681"
  expect 2 "$topple" compare r/record.h5 missing.h5 -o none; expect 2 "$topple" compare r/record.h5 -o none
  [ ! -e none ] || { echo "a folder was made for wrong records"; failures=$((failures + 1)); }
  cp r/record.h5 own.h5; expect 2 "$topple" report own.h5 -o own.h5; has err "written over"
  expect 2 "$topple" report r/record.h5 --compare own.h5 -o own.h5; cmp r/record.h5 own.h5 || failures=$((failures + 1))
  # a study and another computation in the report
  mkdir s
  echo '{"title":"T","runs":2,"failed":0,"verdict":[{"id":"verdict","status":"good","text":"It is sure."}],"inputs":[],
    "outcomes":[{"name":"topple","outputs":[{"name":"of the outcome alone"}]}],"outputs":[]}' >s/results.json
  expect 0 "$topple" report r/record.h5 -o page.html --study s --compare r/record.h5
  has page.html '"text":"It is sure."'; has page.html '"others":[{"engine":"native'
  ! grep -q "of the outcome alone" page.html || { echo "more of the study than the report shows"; failures=$((failures + 1)); }
  echo '{"title":"T"}' >s/results.json
  expect 2 "$topple" report r/record.h5 -o none --study s; has err 'error E682: s/results.json'; has err 'no "runs"'
  expect 2 "$topple" report r/record.h5 -o none --study photos.csv; has err "error E682"
  ;;
import)
  printf '%s\n' 0 SECTION 2 ENTITIES 0 LWPOLYLINE 8 Houses 70 1 10 20 20 0 10 30 20 0 10 30 20 9 0 ENDSEC 0 EOF >site.dxf
  expect 0 "$topple" import site.dxf -o site.toml; has site.toml "[[site.neighbour]]"; has out "1 gap is marked"; has out "Guessed"
  expect 2 "$topple" import site.dxf -o site.toml; has err "exists already"
  expect 2 "$topple" import site.dxf -o site.toml --json; is_json out; has out '"code": "E802"'
  expect 0 "$topple" import site.dxf -o json.toml --json; is_json out; has out '"gaps": 1'; has out '"plan": "json.toml"'; has err "Guessed"
  cmp site.toml json.toml || failures=$((failures + 1))
  tr '\n' '\r' <site.dxf >cr.dxf; expect 0 "$topple" import cr.dxf -o cr.toml; sed 's/cr.dxf/site.dxf/' cr.toml | cmp - site.toml || failures=$((failures + 1))
  sed 's/^30$/3o/' site.dxf | tr '\n' '\r' >cr.dxf; expect 2 "$topple" import cr.dxf -o x.toml; has err "cr.dxf:16:1: error E113"; has err "16 | 3o"
  expect 2 "$topple" import site.dxf -o other.toml --unit "1 s"; has err "--unit"
  cat "$plan" site.toml >gaps.toml
  expect 2 "$topple" check gaps.toml; has err "E211"; has err "site.neighbour[1].clearance"; has err "^"
  expect 2 "$topple" run gaps.toml -o never; has err "E211"; [ ! -e never ] || failures=$((failures + 1))
  expect 2 "$topple" import "$plan" -o x.toml; has err "neither"
  echo hello >b.ifc; expect 2 "$topple" import b.ifc -o x.toml; has err "b.ifc:1:1"; has err "E111"; has err "| hello"
  expect 2 "$topple" import b.ifc -o x.toml --unit "1 mm"; has err "E801"; has err "--unit"
  expect 2 "$topple" import nowhere.ifc -o x.toml
  ;;
export)
  expect 0 "$topple" run "$plan" -o r --no-report
  expect 0 "$topple" export r/record.h5 --csv --json --frame-rate "5 Hz" -o t; has out "Wrote t/series.csv and 7 more"
  [ "$(ls t/*.csv | wc -l)" -eq 8 ] || { echo "not 8 tables"; failures=$((failures + 1)); }
  is_json t/record.json; exists t/poses.csv
  expect 0 "$topple" export r/model.json --adams -o t/model.adm; exists t/model.adm; exists t/model.acf; has out "note: "
  expect 2 "$topple" export r/record.h5 -o t; has err "say what for"
  expect 2 "$topple" export r/record.h5 --csv --adams -o t
  expect 2 "$topple" export r/record.h5 --csv --frame-rate "5 m" -o t; has err "--frame-rate"
  expect 2 "$topple" export r/model.json --csv -o t; has err "E702"; has err "is not a topple record"
  expect 2 "$topple" export r/record.h5 --adams -o t/x.adm; has err "model.json that topple run writes"
  expect 2 "$topple" export r/record.h5 --lsdyna -o t/x.k; has err "a record, not a plan"
  cp r/model.json own.json; expect 2 "$topple" export own.json --adams -o own.json; has err "written over"
  expect 2 "$topple" export own.json --adams -o own.acf; has err "ends in .adm"
  expect 2 "$topple" export own.json --adams -o own.dat; has err "name it as an .adm"; [ ! -e own.dat ] || { echo "a dataset without its commands"; failures=$((failures + 1)); }
  cmp r/model.json own.json || failures=$((failures + 1))
  expect 2 "$topple" export nowhere.h5 --csv -o t; has err "nowhere.h5"
  ;;
check)
  expect 0 "$topple" check "$plan"; has out "no errors"
  sed -e 's/^destroyed_length/destoryed_length/' -e 's/"30 GPa"/"30 m"/' "$plan" >wrong.toml
  expect 2 "$topple" check wrong.toml
  has err "wrong.toml:"; has err "destoryed_length"; has err "did you mean"; has err "errors. Nothing was run."
  expect 2 "$topple" run wrong.toml -o out_folder; has err "Nothing was run."
  [ ! -e out_folder ] || { echo "a folder was made for a wrong plan"; failures=$((failures + 1)); }
  expect 2 "$topple" check wrong.toml --json; is_json out; has out '"line"'
  expect 2 "$topple" check missing.toml
  expect 2 "$topple" check .
  : >empty.toml; expect 2 "$topple" check empty.toml
  NO_COLOR=1 expect 2 "$topple" check wrong.toml; lacks err $'\x1b'
  # what only a study would refuse
  write_random() {
    cat "$plan" - >random.toml <<EOF
[fuzzy.parameters]
mu = { triangular = [0.5, 0.6, 0.7] }
[fuzzy.random]
site.friction = { normal = ["mu", $1] }
[fuzzy.randomness]
runs = 50
statistics = ["$2"]
EOF
  }
  write_random 0.01 "p(topple)"; expect 0 "$topple" check random.toml
  write_random 0.5 "p(topple)"; expect 2 "$topple" check random.toml; has err "E205"; has err 'site: friction: -0.6'
  write_random 0.01 "mean(reach)"; expect 2 "$topple" check random.toml; has err "E825"; has err "^"
  ;;
run)
  expect 0 "$topple" run "$plan" -o a/b --csv --no-report
  has out "rigid bodies"; has out "revolute joints"; has out "force elements"
  has out "Mechanism"; has out "Not modelled"; has out "Verification"; has out "Wrote a/b/record.h5"
  grep -qE '^ +No distance given here is a safe distance\.$' out || { echo "no line of its own on distances"; failures=$((failures + 1)); }
  for f in record.h5 model.json series.csv events.csv bodies.csv findings.csv; do exists a/b/$f; done
  [ ! -e a/b/report.html ] || { echo "a report although --no-report"; failures=$((failures + 1)); }
  [ "$(grep -n '^Mechanism' out | cut -d: -f1)" -lt "$(grep -n '^Stability' out | cut -d: -f1)" ] || failures=$((failures + 1))
  lacks out $'\x1b'
  expect 0 "$topple" new frame.toml; expect 0 "$topple" run frame.toml -o frame --no-report --json
  moving=$(python3 -c 'import json; print(round(json.load(open("out"))["counts"]["mass"] / 1000))')
  has err " t, $moving t of it in motion ("; has err " t of stumps stay)"
  printf '\n[criteria]\nmechanism = "stands"\n' | cat "$plan" - >stands.toml
  expect 3 "$topple" run stands.toml -o c --no-report; has out "Asked: stands"; has out "Violated: Mechanism (Criteria)"
  expect 1 "$topple" run "$plan" -o /proc/nowhere --no-report
  mkdir -p taken/record.h5; expect 1 "$topple" run "$plan" -o taken; has err "taken/record.h5 is a folder"; lacks out "rigid bodies"
  (ulimit -f 4; expect 1 "$topple" run "$plan" -o full --no-report; exit $failures) || failures=$((failures + 1))
  has err "cannot write full/model.json: File too large"; [ -z "$(ls full)" ] || { echo "half a file is left"; failures=$((failures + 1)); }
  expect 0 "$topple" run "$plan" -o a/b --no-report
  has out "Left from before, not of this run: a/b/series.csv, a/b/events.csv, a/b/bodies.csv, a/b/findings.csv"
  expect 0 "$topple" run "$plan" -o a/b --csv --no-report; lacks out "Left from before"
  # a checkpoint, and what a killed process left half written
  sh -c 'exit 0' & gone=$!; wait $gone
  echo half >"a/b/.topple-$gone-0.part"; echo others >"a/b/.topple-$$-0.part"; echo old >a/b/checkpoint.bin
  expect 0 "$topple" run "$plan" -o a/b --csv --no-report
  has out "Left from before, not of this run: a/b/checkpoint.bin, a/b/.topple-$gone-0.part"; lacks out ".topple-$$-0"
  exists "a/b/.topple-$gone-0.part"
  expect 0 "$topple" run "$plan" -o a/b --csv --no-report --checkpoint; lacks out "a/b/checkpoint.bin"
  # complaints on standard error do not cut lines of standard output
  rm -rf full; (ulimit -f $(($(stat -c %s a/b/record.h5) / 2048)); "$topple" run "$plan" -o full --no-report >both 2>&1)
  [[ "$(tail -n 1 both)" == "topple: cannot write full/"*": File too large" ]] || { echo "cut by a complaint:"; cat both; failures=$((failures + 1)); }
  # the same plan and seed give the same bytes of poses
  expect 0 "$topple" run "$plan" -o d --csv --no-report --threads 2
  cmp a/b/series.csv d/series.csv || failures=$((failures + 1))
  ;;
json)
  expect 0 "$topple" run "$plan" -o a --no-report --json
  is_json out; has out '"findings"'; has out '"exit_code": 0'; has out '"record": "a/record.h5"'; has out '"bodies"'
  has err "rigid bodies"
  printf '\n[criteria]\nmechanism = "stands"\n' | cat "$plan" - >stands.toml
  expect 3 "$topple" run stands.toml -o c --no-report --json; is_json out; has out '"criterion.mechanism"'
  printf 'title = 3\n' >wrong.toml
  expect 2 "$topple" run wrong.toml -o c --json; is_json out; has out '"diagnostics"'
  if [ -c /dev/full ]; then
    expect 1 sh -c '"$1" run stands.toml -o d --no-report --json >/dev/full' sh "$topple"
    has err "standard output could not be written"
  fi
  # what cannot be written is told, too
  failed() { expect 1 "$topple" "$@" --json; is_json out; has out '"exit_code": 1'; has out '"code": "E830"'; }
  failed run "$plan" -o /proc/nowhere; has out "/proc/nowhere"
  mkdir -p folder; failed report a/record.h5 -o folder; failed compare a/record.h5 a/record.h5 -o /proc/nowhere
  failed new /proc/nowhere/plan.toml
  printf '%s\n' '{"topple_log": 1}' >log; expect 2 "$topple" replay log -o x --json; is_json out
  # bad input is told on all verbs
  echo junk >junk
  told() { expect 2 "$topple" "$@" --json; is_json out; has out '"exit_code": 2'; has out '"code": "E'; }
  told replay junk -o x; told study "$plan" -o x; told study nowhere -o x; told study show nowhere; told mbs compare junk
  told check "$plan" --bogus; has out "there is no option --bogus"
  told run "$plan" --bogus; has out "there is no option --bogus"; told run --bogus; has out "there is no option --bogus"
  for words in "run p" "mbs run p" "rcc p" "fe p" "compare p p" "replay p" "study p" "steer p" demo "report p" "mbs compare p" "import p"; do
    told $words -o ""; has out "--output: a f"
  done
  told run "$plan" -o x --knowledge ""; has out "--knowledge: a file is wanted"
  for words in "run p -o x" "mbs run p -o x" "mbs compare p" "rcc p -o x" "fe p -o x" "compare p p -o x" "replay p -o x" \
    "study p -o x" "new p" "import p -o x" "report p -o x" "steer p" "worker p" demo doctor run fe; do
    told $words --bogus
  done
  ;;
mbs)
  expect 0 "$topple" run "$plan" -o a --no-report
  expect 0 "$topple" mbs run a/model.json -o b --csv --no-report --duration 0.8s; exists b/record.h5
  has out "Bodies"; has out "Equilibrium"; has out "Energy error"; has out "Stopped by the time limit of 0.80 s"
  # the file says how its plan was run
  expect 0 "$topple" mbs run a/model.json -o b2 --csv --no-report
  expect 0 "$topple" run "$plan" -o a2 --csv --no-report
  [ "$(cut -d, -f1 b2/series.csv)" = "$(cut -d, -f1 a2/series.csv)" ] || { echo "other frames than the plan's"; failures=$((failures + 1)); }
  expect 2 "$topple" mbs run missing.json -o c
  echo '{"bodies": 3}' >wrong.json; expect 2 "$topple" mbs run wrong.json -o c
  head -c 1000 a/model.json >cut.json; expect 2 "$topple" mbs run cut.json -o c
  [ ! -e c ] || { echo "a folder was made for a wrong model"; failures=$((failures + 1)); }
  # outputs
  pendulum=$source/examples/mbs/double_pendulum.json
  expect 0 "$topple" mbs run "$pendulum" -o d --no-report
  has out "2 revolute"; has out "Wrote d/outputs/lower_position.csv"
  has d/outputs/lower_position.csv "time [s],x [m],y [m],z [m]"
  has d/outputs/top_reaction.csv "time [s],x [N],y [N],z [N]"
  [ "$(wc -l <d/outputs/lower_position.csv)" -eq 202 ] || { echo "not 201 samples"; failures=$((failures + 1)); }
  [ "$(wc -l <d/outputs/top_reaction.csv)" -eq 402 ] || { echo "not 401 samples"; failures=$((failures + 1)); }
  [ -z "$(find d -name '*.part')" ] || { echo "half files"; failures=$((failures + 1)); }
  echo old >d/outputs/another.csv; cp "$pendulum" d/model.json
  expect 0 "$topple" mbs run d/model.json -o d --no-report --duration 0.1
  has out "Left from before, not of this run: d/outputs/another.csv"; lacks out "run: d/model.json"
  expect 0 "$topple" mbs run "$pendulum" -o d --no-report --json --duration 0.1
  is_json out; has out '"joint_drift"'; has out '"samples": 11'; has out '"file": "d/outputs/lower_position.csv"'
  # options go before the file
  expect 1 "$topple" mbs run "$pendulum" -o e --no-report --equilibrium; has out "No equilibrium"; has out "--no-equilibrium"
  has e/outputs/lower_position.csv "time [s]"
  expect 2 "$topple" mbs run "$pendulum" -o e --equilibrium --no-equilibrium
  expect 0 "$topple" mbs run "$pendulum" -o f --no-report --step "1 ms" --duration 0.5s; has out "0.5 s in 500 steps of 1 ms"
  expect 0 "$topple" mbs run "$pendulum" -o f --no-report --step "1 ms" --step-share 0.5 --duration 0.5s; has out "0.5 s in 1000 steps of 0.5 ms"
  expect 2 "$topple" mbs run "$pendulum" -o f --no-report --step-share 2; has err "--step-share"
  expect 2 "$topple" mbs run "$pendulum" -o f --no-report --step-share nan; has err "is no number"
  if [ -c /dev/full ]; then
    expect 1 sh -c '"$1" mbs run "$2" -o f --no-report --json --duration 0.1s >/dev/full' sh "$topple" "$pendulum"
    has err "standard output could not be written"
  fi
  # velocities do not go with the equilibrium
  sed 's/"X_WB": {"p": \[1.5, 0, 0\]}/&, "v_WB": [0, 0, 1]/' "$pendulum" >thrown.json
  grep -q v_WB thrown.json || { echo "nothing is thrown"; failures=$((failures + 1)); }
  expect 0 "$topple" mbs run thrown.json -o f --no-report --duration 0.1s
  expect 2 "$topple" mbs run thrown.json -o g --no-report --duration 0.1s --equilibrium; has err 'bodies[1].v_WB "lower": would be lost'; has err "--no-equilibrium"
  sed -i 's/"equilibrium": false/"equilibrium": true/' thrown.json
  expect 2 "$topple" mbs compare thrown.json --engines native --duration 0.1s; has err "would be lost"
  # a mistake is shown where it stands
  sed 's/"child": "lower"/"child": "lwoer"/' "$pendulum" >typo.json
  expect 2 "$topple" mbs run typo.json -o g
  has err 'typo.json:15:'; has err 'there is no body "lwoer"; did you mean "lower"?'; has err '^^^'; has err "1 error. Nothing was run."
  expect 2 "$topple" mbs run typo.json -o g --json; is_json out; has out '"line": 15'
  [ ! -e g ] || { echo "a folder was made for a wrong model"; failures=$((failures + 1)); }
  ;;
compare)
  model=$source/examples/mbs/double_pendulum.json
  expect 0 "$topple" mbs compare "$model" --engines native --duration 0.2s -o a
  has out "native"; has out "ending"; has out "Wrote a/compare.csv"
  : >no_folder
  expect 2 "$topple" mbs compare "$model" --engines native --duration 0.2s -o no_folder; has err "no_folder"; lacks out "energy error"
  expect 2 "$topple" mbs compare "$model" --engines nativ; has err 'did you mean "native"?'
  expect 2 "$topple" mbs compare "$model" --engines native,native; has err "twice"
  expect 0 "$topple" mbs compare "$model" --engines " native ," --duration 0.01s
  expect 2 "$topple" mbs compare missing.json
  expect 2 "$topple" mbs compare "$model" --step "3 apples"; has err "--step"
  expect 0 "$topple" mbs compare "$model" --duration 0.2s --frames 10 --json; is_json out; has out '"energy_error"'
  for engine in simbody mujoco; do
    if ! "$topple" mbs compare "$model" --engines $engine --duration 0.01s >out 2>err; then
      has err "is not built in"; has err "lib$engine-dev"
      continue
    fi
    expect 0 "$topple" mbs compare "$model" --engines native,$engine --duration 0.5s --frames 20 --bodies -o b
    has out "position [m]"; has out "lower"; exists b/compare.csv; exists b/compare.svg
    [ "$(grep -c "^$engine," b/compare.csv)" -eq 21 ] || { echo "not 21 instants"; failures=$((failures + 1)); }
    # contact between bodies that have rules of their own
    falling=$source/examples/mbs/falling_boxes.json
    expect 2 "$topple" mbs compare "$falling" --engines native,$engine --duration 0.01s
    has err "$engine cannot express"; has err "contact."; has err "--skip-unsupported"
    expect 0 "$topple" mbs compare "$falling" --engines native,$engine --duration 0.01s --skip-unsupported
    has out "not run"
  done
  ;;
report)
  expect 0 "$topple" run "$plan" -o a --no-report
  if [ -s "$source/web/dist/report.html" ]; then
    expect 0 "$topple" report a/record.h5 -o r.html; exists r.html; has r.html "Short run"
    expect 0 "$topple" report a/record.h5 -o r2.html --json; is_json out; has out '"report": "r2.html"'; has out '"title"'; rm r2.html
    expect 0 "$topple" run "$plan" -o b; exists b/report.html
  else
    expect 1 "$topple" report a/record.h5 -o r.html; has err "report page is not built"
    expect 0 "$topple" run "$plan" -o b; has err "report page is not built"
    expect 1 "$topple" run "$plan" -o b --report
  fi
  if [ -s "$source/web/dist/report.html" ]; then
    # what is no file stays what it is
    ln -s /dev/null nothing; mkfifo pipe; cat pipe >through.html &
    expect 0 "$topple" report a/record.h5 -o nothing; [ -c nothing ] && [ -L nothing ] || { echo "a device was replaced"; failures=$((failures + 1)); }
    expect 0 "$topple" report a/record.h5 -o pipe; wait; [ -p pipe ] && cmp r.html through.html || { echo "a pipe was replaced"; failures=$((failures + 1)); }
  fi
  echo nonsense >wrong.h5
  expect 2 "$topple" report wrong.h5 -o r2.html
  expect 2 "$topple" report missing.h5 -o r2.html
  expect 2 "$topple" report missing.h5 -o r2.html --json; is_json out; has out '"code": "E701"'
  ;;
cancel)
  start out "fired" "$topple" run "$source/examples/weida/plan.toml" -o a --no-report --duration 500s
  # timeout and batch systems send it twice at once
  for _ in 1 2 3 4 5; do kill -INT $pid 2>/dev/null; sleep 0.005; done
  wait $pid; code=$?
  [ $code -eq 1 ] || { echo "exit code $code after an interrupt"; head out err; failures=$((failures + 1)); }
  exists a/record.h5; has out "Cancelled at"
  # both times of the object are those of the end, not of the last frame
  start err "fired" "$topple" run "$source/examples/weida/plan.toml" -o j --no-report --duration 500s --json
  kill -INT $pid; wait $pid
  python3 -c 'import json; o = json.load(open("out")); assert o["ending_text"] == "Cancelled at %.2f s." % o["simulated_time"], o' || failures=$((failures + 1))
  # exports and what else takes its time end, and leave nothing behind that is not whole
  for words in "export a/record.h5 --vtk -o v" "fe $source/examples/weida/plan.toml --mesh-only --size 0.1m" \
    "export $source/examples/weida/plan.toml --lsdyna --size 0.1m -o v/model.k"; do
    for delay in 0.1 0.2 0.4 0.8; do  # 143: before the program had begun
      "$topple" $words >out 2>err &
      pid=$!; sleep $delay; kill -TERM $pid 2>/dev/null; wait $pid; code=$?
      [ $code -eq 143 ] || break
    done
    if [ $code -eq 0 ]; then has out "Wrote"; rm -rf v; continue; fi  # it was done before
    [ $code -eq 1 ] || { echo "exit code $code after an interrupt of $words"; head out err; failures=$((failures + 1)); }
    has err "Cancelled."
    [ -z "$(find v -type f 2>/dev/null)" ] || { echo "$words leaves $(find v -type f | head -3)"; failures=$((failures + 1)); }
  done
  # killed without a word, it goes on from what it has kept, with the bits of a run that was not
  storehouse=$source/examples/weida/plan.toml
  kill_when_kept() {
    "$topple" "$@" >out 2>err &
    pid=$!; for _ in $(seq 1200); do [ -e kept/checkpoint.bin ] && break; sleep 0.05; done
    kill -KILL $pid; wait $pid 2>/dev/null
    exists kept/checkpoint.bin; [ ! -e kept/record.h5 ] || { echo "it was over"; failures=$((failures + 1)); }
  }
  kill_when_kept run "$storehouse" --checkpoint --checkpoint-interval "0.1 s" --csv --no-report -o kept
  expect 2 "$topple" run "$plan" --resume -o kept; has err "E674"; has err "another plan or model"
  expect 2 "$topple" run "$storehouse" --resume --duration "10 ms" -o kept; has err "E674"; has err "and is to end at 0.01 s"
  expect 0 "$topple" run "$storehouse" --resume --csv --no-report -o kept; has out "Going on from"
  expect 0 "$topple" run "$storehouse" --csv --no-report -o whole
  for table in series bodies events findings; do cmp kept/$table.csv whole/$table.csv || failures=$((failures + 1)); done
  rm -r kept
  kill_when_kept mbs run whole/model.json --checkpoint --checkpoint-interval "0.1 s" --csv --no-report -o kept
  expect 0 "$topple" mbs run whole/model.json --resume --csv --no-report -o kept; has out "Going on from"
  expect 0 "$topple" mbs run whole/model.json --csv --no-report -o again
  for table in series bodies events; do cmp kept/$table.csv again/$table.csv || failures=$((failures + 1)); done
  expect 2 "$topple" run "$plan" --resume -o nowhere; has err "E674"; [ ! -e nowhere ] || { echo "a folder for nothing"; failures=$((failures + 1)); }
  expect 2 "$topple" run "$plan" --checkpoint --engine simbody -o nowhere; has err "--engine simbody excludes --checkpoint"
  expect 2 "$topple" run "$plan" --checkpoint --check-step -o nowhere; has err "excludes"
  expect 2 "$topple" run "$plan" --threads 0x2 -o nowhere; has err "a whole number is wanted"
  expect 2 "$topple" mbs run "$plan" --checkpoint-interval "1 s" -o nowhere; has err "requires --checkpoint or --resume"
  ;;
steer)
  "$topple" new plan.toml >/dev/null
  "$topple" steer plan.toml --no-open -o logs >out 2>err &
  pid=$!
  for _ in $(seq 600); do [ -s out ] && [ -s logs/plan.steer.jsonl ] && break; sleep 0.1; done
  port=$(sed -n 's|http://127.0.0.1:\([0-9]*\)/.*|\1|p' out); token=$(sed -n 's|.*/\([0-9a-f]\{32\}\)/$|\1|p' out)
  fetch() { exec 3<>"/dev/tcp/127.0.0.1/$port" && printf 'GET %s HTTP/1.1\r\nHost: %s\r\nConnection: close\r\n\r\n' "$1" "$2" >&3 && cat <&3; }
  fetch "/$token/api/server" localhost >page; has page "200 OK"; has page '"protocol":1'
  fetch "/$token/api/sessions/1/log" localhost >page; has page topple_log
  fetch "/$token/api/server" example.org >page; has page "403"
  fetch "/0/api/server" localhost >page; has page E901
  kill -INT $pid
  wait $pid; code=$?
  [ $code -eq 0 ] || { echo "exit code $code after an interrupt"; cat out err; failures=$((failures + 1)); }
  # killed in the middle of a line
  printf '{"seq": 9, "action": "set_del' >>logs/plan.steer.jsonl
  expect 0 "$topple" replay logs/plan.steer.jsonl -o again --no-report; has err "no end"; exists again/branch-1/record.h5
  expect 2 "$topple" replay plan.toml -o never; has err E942; has err "Nothing was written."
  { head -1 logs/plan.steer.jsonl; echo '{"seq": 1, "action": "undo", "branch": 1, "step": 40, "time": 0.01, "made": 1, "command": {"command": "set_delay"}}'; } >half.jsonl
  expect 2 "$topple" replay half.jsonl -o never; has err "half.jsonl:2"; has err "Nothing was written."
  [ ! -e never ] || { echo "a folder was left by a replay that was refused"; failures=$((failures + 1)); }
  expect 2 "$topple" steer --continue --no-open -o logs; has err "E801"; has err "needs the plan"
  expect 2 "$topple" steer missing.toml --no-open
  "$topple" steer --no-open --json >out 2>err &
  pid=$!
  for _ in $(seq 600); do [ -s out ] && break; sleep 0.1; done
  kill -INT $pid; wait $pid
  is_json out; has out '"url":"http://127.0.0.1:'; [ "$(wc -l <out)" -eq 1 ] || { echo "more than a line"; failures=$((failures + 1)); }
  expect 2 "$topple" steer plan.toml --no-open --port 99999 --json; is_json out; has out '"code": "E801"'
  expect 2 "$topple" steer plan.toml --no-open --port 99999; has err "1 to 65535"
  expect 2 "$topple" steer plan.toml --no-open -o plan.toml; has err "plan.toml is a file; a folder is wanted"
  ;;
rcc)
  zone=$source/examples/rcc/zone_I.toml
  expect 0 "$topple" rcc "$zone"; has out "zone of 0.39 m"; has out "residual"; has out "crushes at"
  expect 0 "$topple" rcc "$zone" --normal-force "3.7 MN" --normal-force 0 -o a/b; has out "3.700"; has out "Wrote a/b/rcc.json"
  for f in points.csv curves.csv interaction.csv axial.csv states.csv rcc.json; do exists a/b/$f; done
  for f in rcc.html moment_y.png moment_z.png interaction_y.png axial.png section_y_pos_1.png; do exists a/b/$f; done
  is_json a/b/rcc.json; lacks a/b/rcc.html "http"; has a/b/rcc.html "Not modelled"
  expect 0 "$topple" rcc "$zone" --normal-force "3.7 MN" --normal-force 0 --json; is_json out; has err "residual"
  cmp out a/b/rcc.json || failures=$((failures + 1))
  # equal forces count once
  expect 0 "$topple" rcc "$zone" --normal-force "3.7 MN" --normal-force "3700 kN" --normal-force 0 --normal-force "-0 N" --normal-force "3700000.0001 N" -o equal
  has out "+y -y +z -z"; lacks out "-y -y"
  for f in points.csv curves.csv rcc.json; do cmp equal/$f a/b/$f || failures=$((failures + 1)); done
  sed 's/^normal_force = .*//; s/^\[zone\]/&\nnormal_force = ["3.7 MN", "3700 kN", "0 N"]/' "$zone" >equal.toml
  expect 0 "$topple" rcc equal.toml -o listed; cmp listed/points.csv a/b/points.csv || failures=$((failures + 1))
  expect 0 "$topple" rcc "$zone" --normal-force "20 MN"; has out "cannot be carried: strained evenly the section crushes at 8.91 MN"
  expect 0 "$topple" rcc "$zone" --normal-force "-9 MN"; has out "cannot be carried: strained evenly the section tears at 3.2 MN"
  expect 2 "$topple" rcc "$zone" --normal-force "3 apples"; has err "--normal-force"; has err "units: N, kN, MN"
  expect 2 "$topple" rcc "$zone" --normal-force 3.7; has err "has no unit"; expect 0 "$topple" rcc "$zone" --normal-force 0
  for idle in "--rotation 1deg" "--element-size 5cm" "--axis z" "--direction -" "--knowledge rules.json"; do
    expect 2 "$topple" rcc "$zone" $idle; has err "has no effect"
  done
  sed 's/^length = .*//; s/"50 cm"/"110 cm"/g' "$zone" >deep.toml; expect 0 "$topple" rcc deep.toml --normal-force 0
  has out "shorter than one depth of the section (1.1 m)"
  expect 2 "$topple" rcc "$zone" --zone top; expect 2 "$topple" rcc "$zone" --zone middle --member C-A1-0
  # mistakes stand at their places
  sed 's/^eps_u/esp_u/' "$zone" >wrong.toml; expect 2 "$topple" rcc wrong.toml -o none
  has err 'wrong.toml:16:1: error E203: steel.core: unknown key "esp_u"'; has err 'did you mean "eps_u"?'; has err "Nothing was run."
  sed 's/^length = .*/length = "3 m"/' "$zone" >long.toml; expect 2 "$topple" rcc long.toml -o none
  has err "long.toml:30:10: error E611: zone: length"
  expect 2 "$topple" rcc wrong.toml --json; is_json out; has out '"line": 16'
  expect 2 "$topple" rcc missing.toml; expect 2 "$topple" rcc .; : >empty.toml; expect 2 "$topple" rcc empty.toml
  has err "the section file is empty"; expect 2 "$topple" rcc "$zone" --fuzzy empty.toml; has err "the file of fuzzy inputs is empty"
  { echo 'concrete.fc = { triangular = ["20 N/mm2", "25 N/mm2", "40 N/mm2"] }'; echo 'concrete.fct = { formula = "(fc - 26) / 30" }'; } >negative.toml
  expect 2 "$topple" rcc "$zone" --fuzzy negative.toml; has err '-0.0333333 N/mm2'; lacks err ' Pa"'
  [ ! -e none ] || { echo "a folder was made for a wrong section"; failures=$((failures + 1)); }
  echo kept >taken
  expect 2 "$topple" rcc "$zone" -o taken; has err "taken is a file; a folder is wanted"; [ ! -s out ] || { echo "it was computed for nothing"; failures=$((failures + 1)); }
  # the solid route
  coarse=(--element-size "15 cm" --rotation "0.002 rad")
  expect 0 "$topple" rcc "$zone" --normal-force "1 MN" --route solid "${coarse[@]}" -o s1
  has out "solid    +y"; lacks out "layered"; for f in solid_states.csv solid_1.png rcc.html moment_y.png; do exists s1/$f; done
  expect 0 "$topple" rcc "$zone" --normal-force "1 MN" --route both "${coarse[@]}" --axis z --threads 2 -o s2; has out "solid    +z"; has out "layered"
  expect 1 "$topple" rcc "$zone" --normal-force "9.5 MN" --route both "${coarse[@]}"
  has err "topple: solid route, N = 9.5 MN: did not converge at"; has err "last residual"; has out "cannot be carried"
  expect 2 "$topple" rcc "$zone" --route both --rotation "3 m"; has err "--rotation"
  expect 2 "$topple" rcc "$zone" --route both --element-size "-1 cm"; has err "--element-size"
  expect 2 "$topple" rcc "$zone" --route liquid
  "$topple" rcc "$zone" --normal-force "1 MN" --route solid --element-size "4 cm" -o cut >out 2>err &
  pid=$!; sleep 1; kill -INT $pid; wait $pid; code=$?
  [ $code -eq 1 ] || { echo "exit code $code after an interrupt"; cat out err; failures=$((failures + 1)); }
  has err "Cancelled. Nothing was written."; [ ! -e cut ] || { echo "a folder after an interrupt"; failures=$((failures + 1)); }
  # fuzzy inputs
  inputs=$source/examples/rcc/zone_I_fuzzy.toml
  { cat "$inputs"; printf '[search]\nlevels = [0, 0.5, 1]\nsamples = 500\n'; } >fuzzy.toml
  expect 0 "$topple" rcc "$zone" --normal-force "3.7 MN" --fuzzy fuzzy.toml -o f1
  has out "it is crushed by the force alone"; has out "limit of runs"
  for f in fan.csv samples.csv originals.csv fuzzy.json fuzzy.html fan_1.png switch_1.png crushing.png inputs.png rcc.html; do exists f1/$f; done
  is_json f1/fuzzy.json; lacks f1/fuzzy.html "http"; has f1/fuzzy.html "Possibilities are searched for among the runs"
  expect 0 "$topple" rcc "$zone" --normal-force "3.7 MN" --fuzzy fuzzy.toml -o f2 --threads 2
  for f in fan.csv samples.csv originals.csv fuzzy.json fuzzy.html fan_1.png; do cmp f1/$f f2/$f || failures=$((failures + 1)); done
  expect 0 "$topple" rcc "$zone" --normal-force "3.7 MN" --fuzzy fuzzy.toml --axis z --direction - --json; is_json out; has out '"direction": "-"'
  sed 's/(fc - 8)/(fx - 8)/' "$inputs" >wrong.toml
  expect 2 "$topple" rcc "$zone" --fuzzy wrong.toml -o none; has err 'wrong.toml:11:28: error E208'; has err 'there is no value "fx"'
  sed 's/\["10 N/["7 N/' "$inputs" >weak.toml
  expect 2 "$topple" rcc "$zone" --fuzzy weak.toml -o none; has err "weak.toml:9:1: error E205: concrete.fc: fc = 7 N/mm2 is not possible"
  expect 2 "$topple" rcc "$zone" --axis x; expect 2 "$topple" rcc "$zone" --fuzzy missing.toml
  # an interrupt leaves nothing
  "$topple" rcc "$zone" --fuzzy "$inputs" -o cut >out 2>err &
  pid=$!; sleep 0.4; kill -INT $pid; wait $pid; code=$?
  [ $code -eq 1 ] || { echo "exit code $code after an interrupt"; cat out err; failures=$((failures + 1)); }
  has err "Cancelled. Nothing was written."; [ ! -e cut ] || { echo "a folder after an interrupt"; failures=$((failures + 1)); }
  [ ! -e none ] || { echo "a folder was made for wrong inputs"; failures=$((failures + 1)); }
  # a member of a plan
  expect 2 "$topple" rcc "$plan"; has err "this is a plan"; has err "--member"
  building=$source/examples/weida/plan.toml
  expect 0 "$topple" rcc "$building" --member C-D1-0; has out "C-D1-0, foot"; has out "Dead load of"; has out "from the equilibrium"
  expect 0 "$topple" rcc "$building" --member B-A1B1-2 --zone end --normal-force "0 MN"; has out "B-A1B1-2, end"
  expect 2 "$topple" rcc "$building" --member C-D1; has err 'did you mean "C-D1-0"?'
  expect 2 "$topple" rcc "$building" --member S-A1B2-0; has err "neither a column nor a beam"
  ;;
doctor)
  expect 0 "$topple" doctor; has out "topple "; has out "Engines"; has out "native"; has out "Vector instructions"
  has out "Pendulum"; has out "expected 2.36784195"; has out "checks are ok"; lacks out "FAILED"; lacks out $'\x1b'
  expect 0 "$topple" doctor --json; is_json out
  python3 - out <<'PY' || failures=$((failures + 1))
import json, sys
d = json.load(open(sys.argv[1]))
assert d["exit_code"] == 0 and len(d["checks"]) >= 9, d
for c in d["checks"]:
    assert c["ok"] and c["numbers"], c
    for n in c["numbers"]:
        assert abs(n["got"] - n["expected"]) <= n["tolerance"], n
assert sum(c["seconds"] for c in d["checks"]) > 0
PY
  # files cannot be written: the checks that need them fail, the others are done
  expect 1 env TMPDIR="$work/nowhere" "$topple" doctor
  has out "FAILED  Record written"; has out "FAILED  Study written"; has out "2 of"; has out "do not trust"; has out "ok      Pendulum"
  expect 1 env TMPDIR="$work/nowhere" "$topple" doctor --json; is_json out; has out '"exit_code": 1'
  # what was not done is not said to have failed
  for signal in INT TERM HUP; do
    start out "Self-check" "$topple" doctor
    kill -$signal $pid; wait $pid; code=$?
    [ $code -eq 1 ] || { echo "exit code $code after an interrupt"; cat out err; failures=$((failures + 1)); }
    has out "Cancelled: "; has out "nothing is said of the others"; lacks out "FAILED"; lacks out "do not trust"
  done
  # under nohup it goes on when the terminal is gone
  start out "Self-check" nohup "$topple" doctor
  kill -HUP $pid; wait $pid; code=$?
  [ $code -eq 0 ] || { echo "exit code $code under nohup"; cat out err; failures=$((failures + 1)); }
  ;;
demo)
  expect 2 "$topple" demo here; expect 1 "$topple" demo -o /proc/nowhere
  "$topple" demo -o a >out 2>err; code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || { echo "exit code $code"; head out err; failures=$((failures + 1)); }
  has out "Weida"; has out "Mechanism"; has out "What next"; has out "topple steer a/plan.toml"; exists a/record.h5
  cmp a/plan.toml "$source/examples/weida/plan.toml" || failures=$((failures + 1))
  [ ! -s "$source/web/dist/report.html" ] || { exists a/report.html; has out "open a/report.html"; }
  echo "# mine" >>a/plan.toml
  expect 2 "$topple" demo -o a; has err "is not the demo's plan any more"; has a/plan.toml "# mine"
  ;;
completion)
  expect 0 "$topple" completion bash; cp out topple.bash; bash -n topple.bash || failures=$((failures + 1))
  cat >ask.bash <<'SH'
source "$1"
# ask WORDS...: what is offered for the last word
ask() { COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)); COMPREPLY=(); _topple; printf '%s\n' "${COMPREPLY[@]}"; }
SH
  # offers "WORDS" WANTED...: all of these and nothing else if the first is "only"
  offers() {
    local words=$1 only=; shift
    [ "$1" = only ] && { only=1; shift; }
    bash -c 'source ask.bash topple.bash; shift; ask "$@"' _ topple.bash $words | sort >got
    [ "${words: -1}" != " " ] || bash -c 'source ask.bash topple.bash; shift; ask "$@" ""' _ topple.bash $words | sort >got
    for want in "$@"; do grep -qxF -- "$want" got || { echo "\"$words\" does not offer $want, but: $(tr '\n' ' ' <got)"; failures=$((failures + 1)); }; done
    [ -z "$only" ] || [ "$(grep -c . got)" -eq $# ] || { echo "\"$words\" offers more: $(tr '\n' ' ' <got)"; failures=$((failures + 1)); }
  }
  mkdir folder; echo >plan.toml
  offers "topple " run check doctor demo steer study
  offers "topple ru" only run rules
  offers "topple mbs " only run compare verify
  offers "topple run --fr" only
  offers "topple mbs run --fr" only --frame-rate
  offers "topple run --j" only --json
  offers "topple run pl" only plan.toml
  offers "topple run plan.toml -o fo" only folder
  offers "topple report --study " folder plan.toml
  offers "topple rcc plan.toml --zone " only foot top start end
  offers "topple rcc plan.toml --zone = t" only top
  offers "topple completion " only bash zsh fish
  offers "topple run --engine " native
  offers "topple new --template fr" only frame
  offers "topple study " show export plan.toml
  offers "topple study show " plan.toml folder
  expect 0 "$topple" completion zsh; cp out _topple
  if command -v zsh >/dev/null; then
    zsh -n _topple || failures=$((failures + 1))
    zsh -f -c 'autoload -U compinit; compinit -D -u; source ./_topple; (( $+functions[_topple] )) && [[ $_comps[topple] == _topple ]]' ||
      { echo "zsh does not take its script"; failures=$((failures + 1)); }
  fi
  expect 0 "$topple" completion fish; cp out topple.fish
  if command -v fish >/dev/null; then
    HOME=$work fish --no-execute topple.fish || failures=$((failures + 1))
    HOME=$work fish -N -c 'source topple.fish; complete -C "topple mbs run --fr"; complete -C "topple rcc p --zone t"; complete -C "topple doc"; complete -C "topple report --study fo"' >got
    has got "--frame-rate"; has got "top"; has got "doctor"; has got "folder/"; lacks got "verify"
  fi
  expect 2 "$topple" completion csh
  ;;
manual)
  expect 0 "$topple" manual; cp out topple.1
  if command -v man >/dev/null; then
    MANWIDTH=100 man --warnings -l topple.1 >page 2>err || failures=$((failures + 1))
    [ ! -s err ] || { cat err; failures=$((failures + 1)); }
    has page "topple mbs run"; has page "EXIT STATUS"
  fi
  if command -v mandoc >/dev/null; then mandoc -T lint -W warning topple.1 >err || { cat err; failures=$((failures + 1)); }; fi
  ;;
examples)
  # the examples of --help, in one folder: what takes seconds at most is run, the rest is read (arguments_test.cpp)
  cp "$source/examples/rcc/zone_I.toml" section.toml
  { cat "$source/examples/rcc/zone_I_fuzzy.toml"; printf '[search]\nlevels = [0, 1]\nsamples = 200\n'; } >fuzzy.toml
  printf '%s\n' 0 SECTION 2 ENTITIES 0 LWPOLYLINE 8 Houses 70 1 10 2000 20 0 10 3000 20 0 10 3000 20 900 0 ENDSEC 0 EOF >site.dxf
  ran=0
  run_examples() {
    "$topple" "$@" --help | sed -n '/^Examples:/,$p' | grep '^  topple ' | sed 's/   .*//; s/^ *topple //' >lines || true
    while read -r line; do
      case $line in
      *ifc* | *simbody* | *postgresql* | *evaluator* | "mbs compare model.json"* | "demo --open"* | *--open* | "fe plan.toml --size"* | *--resume* ) continue ;;
      esac
      eval "\"$topple\" $line" >said 2>complaints </dev/null; code=$?
      [ $code -eq 0 ] || [ $code -eq 3 ] || { echo "exit code $code: topple $line"; head -5 said complaints; failures=$((failures + 1)); }
      ran=$((ran + 1))
    done <lines
  }
  for verb in new check run; do run_examples $verb; done
  # of the examples that take longer, what others read
  mkdir -p study fe; cp out/record.h5 fe/
  echo '{"title":"","runs":0,"failed":0,"verdict":[],"inputs":[],"outcomes":[],"outputs":[]}' >study/results.json
  for verb in rules report export compare rcc "mbs run" "mbs compare" fe import completion manual version doctor; do run_examples $verb; done
  [ $ran -ge 20 ] || { echo "only $ran examples ran"; failures=$((failures + 1)); }
  exists model.adm; exists zone/rcc.json; exists both/compare.json
  ;;
*) echo "no case $case_name"; failures=1 ;;
esac
exit $((failures > 0))
