# Tests in a stage's log as "passed failed skipped"; a stage without tests counts as one. Needs
# -v status=STATUS, of the stage; 77 says that it was skipped.
/ tests passed, [0-9]+ tests? failed out of / { total += $NF; failed += $4; seen = 1 }
/^ *[0-9]+\/[0-9]+ Test .*\*\*\*Skipped/ { skipped++ }
# unittest: how many ran, then what of them failed or was skipped; a module that is skipped as a whole
# counts as one.
/^Ran [0-9]+ tests? in / { total += $2; ran = $2; seen = 1 }
/^(OK|FAILED)( \(|$)/ && seen {
  count = split($0, parts, /[(,)]/)
  for (i = 2; i <= count; i++) {
    split(parts[i], pair, "=")
    if (pair[1] ~ /failures|errors/) failed += pair[2]
    if (pair[1] ~ /skipped/) { skipped += pair[2]; if (ran == 0) total += pair[2] }
  }
}
END {
  if (status == 77) { total = 1; failed = 0; skipped = 1 }
  else if (!seen) { total = 1; failed = status != 0; skipped = 0 }
  else if (status != 0 && failed == 0) { total++; failed = 1 }
  print total - failed - skipped + 0, failed + 0, skipped + 0
}
