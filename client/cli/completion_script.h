// What a shell has to know to complete the commands of vantage: whom to ask.
#ifndef VANTAGE_CLIENT_CLI_COMPLETION_SCRIPT_H_
#define VANTAGE_CLIENT_CLI_COMPLETION_SCRIPT_H_

namespace vantage::cli {

// Each asks 'vantage completion words', which answers with ':none', ':files' or ':folders' and a
// line 'WORD<tab>DESCRIPTION' for each candidate.
extern const char kBashCompletion[];
extern const char kZshCompletion[];
extern const char kFishCompletion[];

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_COMPLETION_SCRIPT_H_
