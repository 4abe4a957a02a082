#include "base/checkpoint.h"

#include "base/file.h"
#include "base/hash.h"

namespace topple {

namespace {

ArchiveReader read_from(const std::string& bytes, const std::string& path) {
  return {std::as_bytes(std::span(bytes)), "E674", path, "start without --resume"};
}

}  // namespace

void write_checkpoint_file(const std::string& path, const std::string& kind, const std::string& key,
                           const std::function<void(ArchiveWriter&)>& write_contents) {
  ArchiveWriter out;
  out(kind), out(key);
  write_contents(out);
  out.bytes += calc_sha256(out.bytes);
  replace_file(path, out.bytes);
}

CheckpointFile::CheckpointFile(const std::string& path, const std::string& kind, const std::string& key,
                               const std::string& made_of)
    : bytes_(read_file(path)), in_(read_from(bytes_, path)) {
  constexpr size_t kHash = 64;  // digits of calc_sha256 at the end
  std::string found;
  if (bytes_.size() < kind.size() + sizeof(size_t) + kHash) in_.refuse("this is not a checkpoint");
  in_(found);
  if (found != kind) in_.refuse("this is not a checkpoint of this version");
  const std::string hash = bytes_.substr(bytes_.size() - kHash);
  bytes_.resize(bytes_.size() - kHash);
  in_ = read_from(bytes_, path);
  if (calc_sha256(bytes_) != hash) in_.refuse("the checkpoint is cut off or damaged");
  in_(found);
  in_(found);
  if (found != key) in_.refuse("the checkpoint is of another " + made_of);
}

void CheckpointFile::close() const {
  if (!in_.is_done()) in_.refuse("the checkpoint is longer than it should be");
}

}  // namespace topple
