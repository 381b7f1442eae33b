// The columns of a generation in answers, which are rows because a page gets thousands of them.

/** The place of each number in a row, as `GenerationRow` of the server has it. */
export const COLUMN = { generation: 0, best: 1, mean: 2, min: 3, deviation: 4, ms: 5, episodes: 6, completedAt: 7 };
