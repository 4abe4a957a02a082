#pragma once
/// A record of a plan's run around its frames: what it was of, how it ended.

#include <string>

#include "collapse/recorder.h"

namespace topple::collapse {

void fill_provenance(const RunOptions&, const std::string& engine, record::Record&);
/// Plan, counts, plan values, outline and neighbours.
void fill_from_plan(const product::Plan&, const mbs::Model&, const ModelMap&, record::Record&);
/// An event for each charge that does not fire, of those later than a time.
void tell_failing_charges(const product::Plan&, const ModelMap&, Recorder&, double after = -1);
/// Options of the engine; nobody looks at the run yet.
mbs::Options make_mbs_options(const mbs::RunSettings&, const Knowledge&, int threads, const Progress&);
/// Whether the plan asks for a screening of ground vibration: its recorder has to keep speeds then.
bool has_screening(const product::Plan&);
/// Frames and happenings go to the recorder, which must outlive the run.
void record_into(Recorder&, mbs::Options&);
/// How it ended, as a word and a sentence.
///   when  the equilibrium is that of the start, for the words
void fill_ending(const mbs::Summary&, const char* when, record::Record&);
/// Ending and last event; the recorder is finished.
///   when  the equilibrium is that of the start, for the words
void end_record(const mbs::Summary&, const char* when, Recorder&, record::Record&);

}  // namespace topple::collapse
