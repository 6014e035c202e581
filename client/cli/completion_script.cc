#include "client/cli/completion_script.h"

namespace vantage::cli {

const char kBashCompletion[] =
    R"SCRIPT(# bash completion for vantage: put it into /usr/share/bash-completion/completions/vantage, or
# source <(vantage completion bash)
_vantage() {
  local typed=() lines=() paths=() word glue='' current reply line
  # bash takes words apart at ':' and '=', which are in addresses and options.
  for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
    if [[ $word == [:=]* && ${#typed[@]} -gt 0 ]]; then
      typed[-1]+=$word
      glue=1
    elif [[ -n $glue ]]; then
      typed[-1]+=$word
      glue=''
    else
      typed+=("$word")
    fi
  done
  ((${#typed[@]})) || typed=('')
  current=${typed[-1]}
  COMPREPLY=()
  reply=$("${COMP_WORDS[0]}" completion words "${typed[@]}" 2>/dev/null) || return 0
  local kind=${reply%%$'\n'*} taken=${current%"${current##*[:=]}"}
  mapfile -t lines <<<"$reply"
  for line in "${lines[@]:1}"; do
    word=${line%%$'\t'*}
    # What stands before the last ':' or '=' is there already.
    printf -v word %q "${word#"$taken"}"
    COMPREPLY+=("$word")
    [[ $word == */ ]] && compopt -o nospace 2>/dev/null
  done
  case $kind in
    :files)
      compopt -o filenames 2>/dev/null
      mapfile -t paths < <(compgen -f -- "${current#"$taken"}")
      COMPREPLY+=("${paths[@]}")
      ;;
    :folders)
      compopt -o filenames 2>/dev/null
      mapfile -t paths < <(compgen -d -- "${current#"$taken"}")
      COMPREPLY+=("${paths[@]}")
      ;;
  esac
  return 0
}
complete -F _vantage vantage
)SCRIPT";

const char kZshCompletion[] = R"SCRIPT(#compdef vantage
# zsh completion for vantage: put it as _vantage into a folder of $fpath, or
# source <(vantage completion zsh)
_vantage() {
  local -a lines names described open
  local line word
  lines=("${(@f)$("${words[1]}" completion words "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  case ${lines[1]} in
    :files) _files ;;
    :folders) _files -/ ;;
  esac
  for line in "${(@)lines[2,-1]}"; do
    [[ -n $line ]] || continue
    word=${line%%$'\t'*}
    if [[ $word == */ ]]; then
      open+=("$word")
    else
      described+=("${word//:/\\:}:${line#*$'\t'}")
    fi
  done
  (( ${#open} )) && compadd -S '' -a open
  (( ${#described} )) && _describe vantage described
  return 0
}
if [[ $funcstack[1] == _vantage ]]; then
  _vantage "$@"
elif (( $+functions[compdef] )); then
  compdef _vantage vantage
fi
)SCRIPT";

const char kFishCompletion[] =
    R"SCRIPT(# fish completion for vantage: put it into ~/.config/fish/completions/vantage.fish, or
# vantage completion fish | source
function __vantage_complete
    set -l words (commandline -opc)
    set -l token (commandline -ct)
    set -l lines ($words[1] completion words $words[2..-1] "$token" 2>/dev/null)
    switch "$lines[1]"
        case ':files'
            __fish_complete_path "$token"
        case ':folders'
            __fish_complete_directories "$token"
    end
    test (count $lines) -gt 1; and printf '%s\n' $lines[2..-1]
end
complete -c vantage -f -a '(__vantage_complete)'
)SCRIPT";

}  // namespace vantage::cli
