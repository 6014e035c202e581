// Short messages over the page: what happened, what the server refused, and the chance to undo.
import { claimConflict, explain } from "../api/errors";
import type { SessionEvent } from "../gen/vantage/v1/event_pb";
import { t, texts, type Key, type Parameters } from "../texts/texts.svelte";
import { clock } from "../words/numbers";
import { changesSentence } from "../words/changes";
import { accuracy, area } from "../words/numbers";
import type { Job } from "./job.svelte";
import type { Entry } from "./outbox";
import { seconds } from "./site";

export interface Notice {
  id: number;
  words: string;
  // What the server said beside it, in English.
  detail: string;
  bad: boolean;
  undo?: () => void;
}

// How long a message stays, ms: long enough to read it twice and to reach for 'Undo'.
const stays = 9_000;

class Notices {
  list = $state<Notice[]>([]);
  #count = 0;

  say(key: Key, parameters: Parameters = {}, undo?: () => void): void {
    this.#show({
      words: t(key, parameters),
      detail: String(parameters.detail ?? ""),
      bad: key.startsWith("error."),
      undo,
    });
  }

  close(id: number): void {
    this.list = this.list.filter((notice) => notice.id !== id);
  }

  refused(entry: Entry, error: unknown, job: Job): void {
    const conflict = claimConflict(error);
    if (conflict !== undefined) {
      const until =
        conflict.expireTime === undefined ? "" : clock(new Date(seconds(conflict.expireTime) * 1000), texts.locale);
      this.#show({
        words: t(conflict.samePlace ? "claim.taken" : "claim.covered", {
          scanner: job.scannerName(conflict.scanner),
          until,
        }),
        detail: "",
        bad: true,
      });
      // The site has changed in a way that this tablet had not heard of.
      job.planAgain();
      return;
    }
    const { key, detail } = explain(error);
    this.#show({
      words: t("outbox.refused", { action: t(`action.${entry.kind}` as Key), why: t(key) }),
      detail,
      bad: true,
    });
  }

  // What somebody wants to know who looks elsewhere.
  happened(event: SessionEvent, job: Job): void {
    const language = texts.locale;
    if (event.event.case === "scanMerged") {
      const scan = event.event.value.scan;
      if (scan === undefined) return;
      const gain = scan.merge?.obtainedGainM2;
      const bound = scan.registration?.verdict?.errorBoundM;
      this.#show({
        words: [
          t(gain === undefined || bound === undefined ? "happened.merged" : "happened.mergedWith", {
            station: job.stationName(scan.name),
            area: area(Math.max(0, gain ?? 0), language),
            accuracy: accuracy(bound ?? 0, language),
          }),
          changesSentence(scan, t, language),
        ]
          .filter((words) => words !== "")
          .join(" "),
        detail: "",
        bad: false,
      });
    } else if (event.event.case === "scanRefused") {
      const scan = event.event.value.scan;
      if (scan !== undefined) {
        this.#show({ words: t("happened.refused", { station: job.stationName(scan.name) }), detail: "", bad: true });
      }
    }
  }

  #show(notice: Omit<Notice, "id">): void {
    const id = ++this.#count;
    this.list = [...this.list.slice(-1), { ...notice, id }];
    setTimeout(() => this.close(id), stays);
  }
}

export const notices = new Notices();
