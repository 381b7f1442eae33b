// The moment that players show: one clock for all players side by side.

import { clamp } from "swarm/scales.js";

/** Steps per second. */
const SPEEDS = [2, 5, 10, 20, 40, 80, 160, 320];

export class Clock {
  constructor(step = 0) {
    Object.assign(this, { step, share: 0, isPlaying: false, steps: 0 });
    this.place = SPEEDS.indexOf(20);
    this.players = [];
    /** Changes with each start, which ends the frames of earlier starts. */
    this.starts = 0;
  }

  /** Adds a player with a number of steps; the longest player determines the end. */
  join(player, steps) {
    this.players.push(player);
    this.steps = Math.max(this.steps, steps);
    this.step = clamp(this.step, this.steps);
  }

  get speed() {
    return SPEEDS[this.place];
  }

  changeSpeed(by) {
    this.place = clamp(this.place + by, SPEEDS.length);
    this.tell();
  }

  seek(step) {
    Object.assign(this, { step: clamp(step, this.steps), share: 0 });
    this.tell();
  }

  toggle() {
    if (this.isPlaying) return this.pause();
    if (this.step === this.steps - 1) this.seek(0);
    this.isPlaying = true;
    const start = ++this.starts;
    let before = performance.now();
    const frame = (now) => {
      if (!this.isPlaying || start !== this.starts) return;
      this.advance((Math.max(0, now - before) / 1000) * this.speed);
      before = now;
      requestAnimationFrame(frame);
    };
    this.tell();
    requestAnimationFrame(frame);
  }

  /** Advances by a number of steps, which need not be whole. */
  advance(by) {
    const at = Math.min(this.step + this.share + by, this.steps - 1);
    this.step = Math.floor(at);
    this.share = at - this.step;
    if (at >= this.steps - 1) this.pause();
    else this.tell();
  }

  pause() {
    Object.assign(this, { isPlaying: false, share: 0 });
    this.tell();
  }

  tell() {
    for (const player of this.players) player.tick();
  }
}
