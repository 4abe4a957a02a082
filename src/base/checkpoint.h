#pragma once
/// Files from which a run goes on: what they are, what they are of, the state, and a hash of it all.

#include <functional>
#include <string>

#include "base/archive.h"

namespace topple {

/// Writes it beside, then renames it.
///   kind  and version of the contents, such as "topple-checkpoint-1"
///   key   of what the run is made of: a checkpoint of something else is refused
void write_checkpoint_file(const std::string& path, const std::string& kind, const std::string& key,
                           const std::function<void(ArchiveWriter&)>& write_contents);

/// Its contents, of this kind and key. Throws InputError E674.
class CheckpointFile {
 public:
  ///   made_of  what the key tells apart, for the error, such as "plan, mesh, step or version"
  CheckpointFile(const std::string& path, const std::string& kind, const std::string& key, const std::string& made_of);
  CheckpointFile(const CheckpointFile&) = delete;
  CheckpointFile& operator=(const CheckpointFile&) = delete;

  ArchiveReader& contents() { return in_; }
  /// All of it has been read, or it is refused.
  void close() const;

 private:
  std::string bytes_;
  ArchiveReader in_;
};

}  // namespace topple
