// SPDX-License-Identifier: BSD-3-Clause
#include "options/resume_options.hpp"

#include <filesystem>
#include <iostream>

#include "gpureg/error.hpp"

namespace gpureg::cli {

std::pair<Option, Option> ResumeOptions::add_to(Verb verb) {
  const Option go_on =
      verb.flag("--resume", resume, "Go on where an interrupted run of this output stopped");
  const Option anew =
      verb.flag("--restart", restart, "Discard what an interrupted run of this output did")
          .excludes(go_on);
  return {go_on, anew};
}

PairJournal::Mode ResumeOptions::mode() const {
  if (resume) return PairJournal::Mode::resume;
  return restart ? PairJournal::Mode::restart : PairJournal::Mode::fresh;
}

void ResumeOptions::check(const std::string& journal) const {
  found_ = std::filesystem::exists(journal);
  with(journal, [&] { PairJournal::check(journal, mode()); });
}

void ResumeOptions::tell(const std::string& journal, std::size_t done, std::size_t all) const {
  if (!resume) return;
  if (found_)
    std::cerr << "gpureg: " << done << " of " << all << " pairs are done already" << std::endl;
  else
    std::cerr << "gpureg: there is nothing to resume, as no " << journal
              << " of an unfinished run is there; all pairs are aligned" << std::endl;
}

void ResumeOptions::close(PairJournal& journal, const FragmentFolder& folder, bool quiet) {
  if (folder.unusable.empty()) {
    journal.remove();
    return;
  }
  journal.set_note(kOutputsWritten);
  if (!quiet)
    std::cerr
        << "gpureg: once those fragments are repaired or removed, go on with the same command "
           "and --resume"
        << std::endl;
}

void ResumeOptions::with(const std::string& journal, const std::function<void()>& work) const {
  const std::string anew = "with --restart instead of --resume to start anew";
  try {
    work();
  } catch (const UnfinishedRun& error) {
    throw IoError(std::string(error.what()) + ": --resume continues it, --restart discards it");
  } catch (const OtherRun& error) {
    throw IoError("cannot resume from " + journal + ": " + error.what() + ", or call " + anew);
  } catch (const DamagedJournal& error) {
    throw IoError(std::string(error.what()) + "; call " + anew);
  }
}

}  // namespace gpureg::cli
