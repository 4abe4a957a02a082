#include "base/checkpoint.h"

#include "base/file.h"
#include "base/hash.h"

namespace topple {

void write_checkpoint_file(const std::string& path, const std::string& kind, const std::string& key,
                           const ArchiveWriter& contents) {
  ArchiveWriter out;
  out(kind), out(key);
  out.bytes += contents.bytes;
  out.bytes += calc_sha256(out.bytes);
  replace_file(path, out.bytes);
}

CheckpointFile::CheckpointFile(const std::string& path, const std::string& kind, const std::string& key,
                               const std::string& made_of)
    : bytes_(read_file(path)), in_(bytes_, "E674", path, "start without --resume") {
  constexpr size_t kHash = 64;  // digits of calc_sha256 at the end
  std::string found;
  if (bytes_.size() < kind.size() + sizeof(size_t) + kHash) in_.refuse("this is not a checkpoint");
  in_(found);
  if (found != kind) in_.refuse("this is not a checkpoint of this version");
  const std::string hash = bytes_.substr(bytes_.size() - kHash);
  bytes_.resize(bytes_.size() - kHash);
  in_ = ArchiveReader(bytes_, "E674", path, "start without --resume");
  if (calc_sha256(bytes_) != hash) in_.refuse("the checkpoint is cut off or damaged");
  in_(found);
  in_(found);
  if (found != key) in_.refuse("the checkpoint is of another " + made_of);
}

void CheckpointFile::close() const {
  if (!in_.is_done()) in_.refuse("the checkpoint is longer than it should be");
}

}  // namespace topple
