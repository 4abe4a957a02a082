#pragma once
/// The scene `frame255`: a frame of boxes on linear-brittle connections that topples.

#include "mbs/model.h"

namespace topple::bench {

/// Five storeys, eight bays (unless said otherwise) of 5 m by one of 6 m: 90 columns, 125 beams and 40 slabs, 1900 t,
/// joined by 660 six-component connections that are elastic up to their limits and then gone. After 1 ms the front row
/// of nine columns loses its hold on the ground; 0.8 m are free below the columns, so that the frame drops in front and
/// breaks. More bays make it longer and heavier: 30 bodies and about 80 connections for each further one.
mbs::Model make_frame(int bays = 8);

}  // namespace topple::bench
