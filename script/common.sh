# Shared by the scripts beside it; they source it from the project's root.

say() { printf '\033[1m==>\033[0m %s\n' "$*" | if [[ -t 1 && -z ${NO_COLOR:-} ]]; then cat; else sed 's/\x1b\[[0-9]*m//g'; fi; }

# fail MESSAGE [HINT]
fail() {
  printf 'error: %s\n' "$1" >&2
  [[ -z ${2:-} ]] || printf '  hint: %s\n' "$2" >&2
  exit 1
}

cores() { nproc 2>/dev/null || echo 1; }

# has_node: whether a Node.js of version 18.13 or later and npm can be called
has_node() {
  command -v npm >/dev/null 2>&1 &&
    node -e 'const [a, b] = process.versions.node.split(".").map(Number); process.exit(a > 18 || (a === 18 && b >= 13) ? 0 : 1)' >/dev/null 2>&1
}

# build_page demo|test: web/dist/*.html from the sources in web/; "test" also fetches what checks it
build_page() {
  local want=$1 stamp=web/node_modules/.topple lock have page=web/dist/report.html options=(--no-audit --no-fund)
  lock="$(sha256sum <web/package-lock.json | cut -d' ' -f1) node $(node -p process.versions.modules)"
  have=$(cat "$stamp" 2>/dev/null || true)
  if [[ $have != "$lock test" && $have != "$lock $want" ]]; then
    say "fetching the pages' libraries (npm ci)"
    [[ $want == test ]] || options+=(--omit=dev)
    (cd web && npm ci "${options[@]}") ||
      fail "npm ci failed in web/" "it needs the npm registry that your .npmrc names"
    printf '%s' "$lock $want" >"$stamp"
  fi
  if [[ ! -s $page || -n $(find web/src web/build.mjs web/package.json web/package-lock.json -newer "$page" -print -quit) ]]; then
    say "building the pages"
    (cd web && npm run --silent build) || fail "the pages could not be built" "rm -rf web/node_modules and try again"
  fi
}

# configure PRESET [OPTION ...]
configure() {
  local output
  output=$(cmake --preset "$@" 2>&1) || {
    printf '%s\n' "$output" >&2
    fail "CMake could not configure the build" "rm -rf build/$1 and try again; script/bootstrap names missing packages"
  }
}

# build PRESET [OPTION ...]
build() {
  local preset=$1
  shift
  cmake --build --preset "$preset" --parallel "$(cores)" "$@" ||
    fail "the build failed" "the first error above counts; with little memory: cmake --build --preset $preset --parallel 1"
}
