#include <cstdio>
#include <filesystem>

#include "base/error.h"
#include "base/file.h"
#include "commands.h"
#include "record/compare.h"
#include "results.h"

namespace topple::apps {

int compare_records(const Arguments& a) {
  try {
    const record::Record first = record::read_hdf5(a.input), second = record::read_hdf5(a.fe.second);
    std::vector<record::Photo> photos;
    if (!a.fe.photos.empty()) photos = record::read_photos(a.fe.photos);
    tell_of_other_title(a.fe.second, second.provenance.title, first.provenance.title);
    const record::Comparison c = record::compare(first, second, a.input, a.fe.second);
    make_folder(a.output);
    const auto in = [&a](const char* name) { return (std::filesystem::path(a.output) / name).string(); };
    const std::string text = record::describe(c, first, second), data = record::to_json(c, first);
    Files files{{"text", in("compare.txt")}, {"csv", in("compare.csv")}, {"json", in("compare.json")}};
    try {
      replace_file(files[0].second, text);
      replace_file(files[1].second, record::to_csv(c, first));
      replace_file(files[2].second, data);
      if (const auto bundle = find_bundle("compare.html")) {
        record::write_compare_page(c, first, second, photos, *bundle, in("compare.html"));
        files.emplace_back("page", in("compare.html"));
      } else {
        std::fprintf(stderr, "The page is not built, so there is no compare.html (npm ci && npm run build in web/).\n");
      }
    } catch (...) {  // e.g. a full disk: files that do not belong together are none
      std::error_code ignored;
      for (const char* name : {"compare.txt", "compare.csv", "compare.json", "compare.html"})
        if (std::filesystem::is_regular_file(in(name), ignored)) std::filesystem::remove(in(name), ignored);
      throw;
    }
    std::FILE* out = a.json ? stderr : stdout;
    if (!a.json) std::fprintf(out, "%s\n", text.c_str());
    for (const auto& [what, path] : files) std::fprintf(out, "Wrote %s\n", path.c_str());
    if (a.json) std::printf("%s\n", data.c_str());
    return kOk;
  } catch (const InputError& e) { return refuse(e, {}, {}, a.json); }
}

}  // namespace topple::apps
