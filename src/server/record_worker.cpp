#include "server/record_worker.h"

#include <algorithm>

namespace topple::server {

namespace {

InputError make_cancelled() { return {"E930", "the branch is gone", "ask again"}; }

}  // namespace

RecordWorker::RecordWorker(std::function<void()> on_idle) : on_idle_(std::move(on_idle)) {
  thread_ = std::thread([this] { work(); });
}

RecordWorker::~RecordWorker() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  cancel_ = true;
  wakes_.notify_all();
  thread_.join();
  for (const RecordRequest& r : waiting_) r.refuse(make_cancelled());
}

void RecordWorker::ask(RecordRequest request) { waiting_.push_back(std::move(request)); }

void RecordWorker::serve(const collapse::Steering& steering) {
  {
    const std::lock_guard lock(mutex_);
    if (is_busy_) return;
  }
  while (!waiting_.empty()) {
    auto job = std::make_unique<Job>();
    const std::vector<int> branches = waiting_.front().branches;
    const auto others = std::stable_partition(waiting_.begin(), waiting_.end(),
                                              [&](const RecordRequest& r) { return r.branches == branches; });
    std::move(waiting_.begin(), others, std::back_inserter(job->requests));
    waiting_.erase(waiting_.begin(), others);
    try {
      for (const int id : branches) {
        const collapse::Branch& b = steering.branch(id);
        if (b.frames() == 0) throw InputError("E930", "the branch has no frame yet");
        Copy copy{steering.copy_record(b), {}};
        for (const collapse::LiveModel::Applied& e : b.run().model().applied()) copy.edits.push_back({e.time, e.text});
        job->copies.push_back(std::move(copy));
      }
    } catch (const InputError& e) {
      for (const RecordRequest& r : job->requests) r.refuse(e);
      continue;
    }
    {
      const std::lock_guard lock(mutex_);
      job_ = std::move(job);
      is_busy_ = true;
      cancel_ = false;
    }
    wakes_.notify_all();
    return;
  }
}

void RecordWorker::cancel() {
  cancel_ = true;
  for (const RecordRequest& r : waiting_) r.refuse(make_cancelled());
  waiting_.clear();
}

void RecordWorker::finish(Job& job) {
  const auto refuse = [&](const InputError& e) {
    for (const RecordRequest& r : job.requests) r.refuse(e);
  };
  JudgedBranches judged;
  try {
    auto list = std::make_shared<std::vector<JudgedBranch>>();
    for (Copy& c : job.copies) {
      auto record = c.record->finish(&cancel_);
      if (!record) return refuse(make_cancelled());
      list->push_back({c.record->branch(), c.record->time(), std::move(*record), c.record->model().map().note_texts(),
                       std::move(c.edits), c.record->start()});
      c.record.reset();
    }
    judged = std::move(list);
  } catch (const std::exception& e) { return refuse(InputError("E940", e.what())); }
  for (const RecordRequest& r : job.requests) r.use(judged);
}

void RecordWorker::work() {
  for (;;) {
    std::unique_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      wakes_.wait(lock, [this] { return closing_ || job_ != nullptr; });
      job = std::move(job_);
      if (job == nullptr) return;
    }
    finish(*job);
    job.reset();
    {
      const std::lock_guard lock(mutex_);
      is_busy_ = false;
    }
    on_idle_();
  }
}

}  // namespace topple::server
