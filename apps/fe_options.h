#pragma once
/// What was typed for topple fe and topple compare.

#include <string>

namespace topple::apps {

struct FeArguments {
  std::string size = "0.4 m";  // of elements
  int across = 2;              // of them, at least, over the thickness of columns and beams
  std::string scaled_step;     // empty: no mass scaling
  std::string second, photos;  // of compare: the other record, and a table of pictures
  bool mesh_only = false, skip_quiet = false;
  bool lsdyna = false;  // of export
};

}  // namespace topple::apps
