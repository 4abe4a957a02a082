#pragma once
/// Elements in chunks that lie close together and fit the cache, nodes in the order of the chunks that own them. A
/// chunk is the unit of work of a thread; nodes of several chunks get their forces summed in a fixed order.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fem/explicit_kernel.h"
#include "fem/explicit_model.h"

namespace topple::fem {

struct ElementChunk {
  size_t first_block = 0, blocks = 0;   // of W slots, each of one material
  size_t first_row = 0, own = 0;        // rows of nodes that belong to no other chunk
  size_t first_shared = 0, shared = 0;  // into shared_rows, and rows of shared forces
};

struct ExplicitChunks {
  size_t W = 1;
  std::vector<ElementChunk> chunks;
  std::vector<std::uint32_t> slot_of_element;
  std::vector<int> element_of_slot;  // -1: empty
  std::vector<std::uint16_t> material_of_block;
  std::vector<std::uint8_t> joined;           // blocks: faces ζ = -1 are those ζ = +1 of the block before
  std::vector<std::uint8_t> turn_of_element;  // its axes ξ η ζ here are those of the model turned on by so many
  std::vector<int> order;                     // elements of chunk after chunk, neighbours close
  // rows: of each chunk its own nodes, then copies of the shared ones that its elements read; then nodes of several
  // chunks
  std::vector<std::uint32_t> row_of_node;
  std::vector<int> node_of_row;                // of copies as well
  std::vector<std::uint16_t> corners;          // kNodeFields times the places among the chunk's nodes, 8 x W a block
  std::vector<std::uint32_t> shared_rows;      // of chunk after chunk
  size_t first_shared_row = 0;                 // shared nodes, and those without elements, come last
  std::vector<std::uint32_t> starts, entries;  // of shared nodes: their rows of shared forces
  size_t most_nodes = 0;                       // of a chunk
  size_t slots() const { return element_of_slot.size(); }
};

/// The corners of an element turned by 0 to 2 axes.
std::array<int, 8> turn_corners(const std::array<int, 8>& node, int turn);

/// Elements of a chunk that its nodes, of which several belong to more than one, and the number of threads call for.
size_t choose_chunk(const ExplicitModel&);
/// Chunks are smaller where kNodeFields times their nodes would not fit 16 bits.
ExplicitChunks make_chunks(const ExplicitModel&, size_t lanes, size_t elements_a_chunk);

}  // namespace topple::fem
