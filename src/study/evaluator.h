#pragma once
/// Any program as a model: it reads points as JSON lines and answers JSON lines (docs/study.md).

#include <string>
#include <vector>

#include "base/error.h"
#include "study/model.h"

namespace topple::study {

/// One point as a line: {"id":0,"inputs":{"fc":25,...}}.
std::string write_request(int id, const std::vector<std::string>& names, const Point&);

/// Understands one line. `id` stays as it is where the answer has none. An answer that cannot be understood becomes
/// Refused, with a text for `read_refusal`.
Answer read_answer_line(const std::string& line, const std::string& command, int& id);

/// Of a program that has never answered, though it was started many times. Where its model has answers from elsewhere,
/// it counts as crashed.
constexpr const char* no_answer_code = "E828";
/// How the text of a run that has waited in vain begins.
constexpr const char* no_answer_within = "no answer within";

/// The complaint of a refused answer, and the line that it points into.
struct Refusal {
  Diagnostic diagnostic;
  std::string line;
};
std::string write_refusal(const Refusal&);
Refusal read_refusal(const std::string& text);

/// Names of an answer's outputs, sorted.
std::vector<std::string> list_outputs(const Answer&);
AnswerForm form_of(const Answer&);
/// The answer, or Refused (E823) where its outputs or the length of its trajectory are not those of the other points.
Answer compare_form(const Answer&, const AnswerForm& elsewhere);

/// Factory of the kind "evaluator". Of the definition: inputs; identity.command; settings.timeout [s],
/// settings.one_shot (a process for each call, whose input is closed behind the points).
Runner make_evaluator(const std::string& definition);

}  // namespace topple::study
