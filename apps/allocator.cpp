/// Options of jemalloc, which it reads before main(); linked into programs, not into the library
/// (docs/decisions/0183-memory-in-large-pages.md).

extern "C" {
// NOLINTNEXTLINE(readability-identifier-naming): jemalloc's name
extern const char* malloc_conf;
const char* malloc_conf = "thp:always,metadata_thp:auto";
}
