# Prints what zsh offers for a command line, one word a line, in a shell of its own on a pseudo-terminal.
# Usage: zsh -f complete.zsh FOLDER_OF_FUNCTIONS LINE
zmodload zsh/zpty || exit 77
zpty child zsh -f -i
zpty -w child "PROMPT=; fpath=(${(q)1} \$fpath); autoload -Uz compinit; compinit -u -D"
# With -O, -A and -D compadd fills arrays of its caller and offers nothing.
zpty -w child '
compadd() {
  if [[ "${@[1,(i)(-|--)]}" == *-(O|A|D)\ * ]]; then builtin compadd "$@"; return; fi
  local -a offered
  builtin compadd -A offered "$@"
  (( $#offered )) && print -rl -- "<"$^offered">"
  builtin compadd "$@"
}
offer() { _main_complete; print -r -- "<end>"; compstate[list]=; compstate[insert]= }
zle -C offer complete-word offer
bindkey "^I" offer
print -r -- "<rea""dy>"'
while zpty -r child line && [[ $line != *"<ready>"* ]]; do :; done
zpty -w -n child "$2"$'\t'
while zpty -r child line; do
  line=${line//[$'\r\n']/}
  [[ $line == *"<end>"* ]] && break
  [[ $line =~ "<(.*)>$" ]] && print -r -- $match[1]
done
zpty -d child
